"""Records: named state that Python objects and compiled kernels share."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import deepcopy
from dataclasses import dataclass
from types import new_class
from typing import Annotated, Any, ClassVar, Generic, Self, TypeVar, cast, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

_SCALARS: dict[Any, Any] = {float: np.float64, int: np.int64, bool: np.bool_}
_ARRAYS: dict[Any, Any] = {NDArray[np.float64]: np.float64, NDArray[np.int64]: np.int64}


@dataclass(frozen=True)
class OpenLength:
    """Length of arrays that a kind of record leaves open: the number given to `Record.sized`, and `more`."""

    more: int = 0

    def __radd__(self, more: int) -> OpenLength:
        return OpenLength(self.more + more)


class _Number:
    """Descriptor of a field of a record that is one number or truth value."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __get__(self, record: Record | None, owner: type) -> Any:
        return self if record is None else record.views[self._name].item()

    def __set__(self, record: Record, value: Any) -> None:
        record.views[self._name][...] = value


class Record:
    """State with named fields in one block of memory: attributes for Python, a structure for kernels.

    A subclass declares its fields: ``float``, ``int``, ``bool``, with a default where that is not zero;
    ``Annotated[NDArray[np.float64], n, m]`` (or ``np.int64``) for an array of that shape; another record; or
    ``Annotated[RecordArray[Wheel], n]`` for n of another kind. Kernels are given `array` and see the fields of its one
    element::

        class Wheels(Record):
            rate_radps: Annotated[NDArray[np.float64], 2]
            still: bool = True

        @kernel
        def turn(wheels: Sequence[Wheels]) -> None:
            wheels[0].still = wheels[0].rate_radps[0] == 0.0

        wheels = Wheels()
        turn(wheels.array)

    Kernels pass on the array or its element: unlike arrays, elements are not counted by reference.

    Where the length of an array differs from robot to robot, it is an `OpenLength`; so is a record open that holds such
    a one. It is made by ``Wheels.sized(4)()``, and kernels loop over the length of the array that they are given. They
    are compiled for each number that is in use.
    """

    dtype: np.dtype[np.void]
    array: Sequence[Self]
    """Structured array (1,) over the same memory, for kernels."""
    _whole: tuple[Record, str] | None = None  # record that it is a part of, and the field
    _blank: NDArray[np.void]  # (1,) with the defaults
    _records: dict[str, type[Record]]
    _rows: dict[str, type[Record]]
    _hints: dict[str, Any]  # of the fields
    _defaults: dict[str, Any]
    _open = False  # whether the length of an array is, still
    _sized: ClassVar[dict[tuple[type[Record], int], type[Record]]] = {}

    def __init_subclass__(cls, *, length: int | None = None) -> None:
        """Lay the fields out in memory, unless a length is open; `length` is for `sized` alone."""
        if length is None:
            hints = get_type_hints(cls, include_extras=True)
            cls._hints = {name: hints[name] for name in cls.__annotations__ if not name.startswith("_")}
            cls._defaults = {name: cls.__dict__[name] for name in cls._hints if name in cls.__dict__}
            for name, hint in cls._hints.items():
                if hint in _SCALARS:
                    setattr(cls, name, _Number(name))
            if any(map(_is_open, cls._hints.values())):
                cls._open = True
                return
        cls._open = False
        cls._lay_out(length or 0)

    @classmethod
    def _lay_out(cls, length: int) -> None:
        cls._records, cls._rows, fields = {}, {}, list[Any]()
        for name, hint in cls._hints.items():
            if get_origin(hint) is Annotated:
                kind, *lengths = get_args(hint)
                shape = tuple(length + each.more if isinstance(each, OpenLength) else each for each in lengths)
                if get_origin(kind) is RecordArray:
                    cls._rows[name] = get_args(kind)[0].sized(length)
                    fields.append((name, cls._rows[name].dtype, shape))
                else:
                    fields.append((name, _ARRAYS[kind], shape))
            elif hint in _SCALARS:
                fields.append((name, _SCALARS[hint]))
            else:
                cls._records[name] = hint.sized(length)
                fields.append((name, cls._records[name].dtype))
        cls.dtype = np.dtype(fields, align=True)
        cls._blank = np.zeros(1, cls.dtype)
        for name, kind in (*cls._records.items(), *cls._rows.items()):
            cls._blank[name] = kind._blank
        for name, value in cls._defaults.items():
            cls._blank[name] = value

    @classmethod
    def sized(cls, length: int) -> type[Self]:
        """This kind of record with a number for its open length; the kind itself if none is open."""
        if not cls._open:
            return cls
        if (cls, length) not in cls._sized:
            told = {"__module__": cls.__module__, "__doc__": cls.__doc__}
            made = new_class(cls.__name__, (cls,), {"length": length}, lambda names: names.update(told))
            cls._sized[cls, length] = made
        return cast("type[Self]", cls._sized[cls, length])

    def __init__(self, **values: Any) -> None:
        """Create a record with these values, and the defaults for all other fields."""
        if self._open:
            name = type(self).__name__
            raise TypeError(f"{name} leaves the length of arrays open; make it by {name}.sized(length)()")
        self._lie_in(np.zeros(1, self.dtype))
        self.reset(**values)

    @classmethod
    def row(cls, length: int) -> Sequence[Self]:
        """Create a structured array (length,) of such records, all zero, for kernels."""
        return cast("Sequence[Self]", np.zeros(length, cls.dtype))

    @classmethod
    def _over(cls, array: NDArray[np.void]) -> Self:
        """Create a record whose fields lie in this memory, (1,) of `dtype`."""
        record = cls.__new__(cls)
        record._lie_in(array)
        return record

    def _lie_in(self, array: NDArray[np.void]) -> None:
        """Use this memory, (1,) of `dtype`, for the fields."""
        self._array, self.array = array, cast("Sequence[Self]", array)
        self.views: dict[str, NDArray[Any]] = {}
        for name in self.dtype.names or ():
            if name in self._records:
                part = self._records[name]._over(array[name])
                part._whole = (self, name)
                setattr(self, name, part)
            elif name in self._rows:
                setattr(self, name, RecordArray(self._rows[name], array[name][0]))
            else:
                self.views[name] = array[name][0, ...]
                if self.views[name].ndim > 0:
                    setattr(self, name, self.views[name])

    def reset(self, **values: Any) -> None:
        """Set these values, and all other fields to their defaults."""
        self._array[:] = self._blank
        for name, value in values.items():
            self.views[name][...] = value

    def assign(self, other: Self) -> None:
        """Set all fields to those of another record."""
        self._array[:] = other._array

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Copy the record to memory of its own; the copy of a part is a part of the copy."""
        if self._whole is not None:
            whole, name = self._whole
            part: Self = getattr(deepcopy(whole, memo), name)
            return part
        copied = type(self)()
        copied.assign(self)
        memo[id(self)] = copied
        return copied


def _is_open(hint: Any) -> bool:
    """Return whether a field's length, or that of a field of a record that it holds, is open."""
    kind, *lengths = get_args(hint) if get_origin(hint) is Annotated else (hint,)
    if get_origin(kind) is RecordArray:
        (kind,) = get_args(kind)
    return any(isinstance(each, OpenLength) for each in lengths) or bool(getattr(kind, "_open", False))


_Kind = TypeVar("_Kind", bound=Record)


class RecordArray(Generic[_Kind]):
    """Records of one kind, a field of another record; their number is part of that field's type.

    An element lies in the memory of the whole: setting it changes the whole.
    """

    def __init__(self, kind: type[_Kind], array: NDArray[np.void]) -> None:
        """Wrap the records in this memory, (n,) of the dtype of their kind."""
        self._kind, self._array, self.array = kind, array, cast("Sequence[_Kind]", array)

    def __len__(self) -> int:
        return len(self._array)

    def __getitem__(self, index: int) -> _Kind:
        at = range(len(self))[index]
        return self._kind._over(self._array[at : at + 1])

    def __iter__(self) -> Iterator[_Kind]:
        return (self[index] for index in range(len(self)))

    def __setitem__(self, index: int, record: _Kind) -> None:
        self[index].assign(record)

    def reset(self) -> None:
        """Set all fields of all records to their defaults."""
        self._array[:] = self._kind._blank
