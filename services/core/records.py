"""Records: named state that Python objects and compiled kernels share."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from typing import Annotated, Any, Self, cast, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

_SCALARS: dict[Any, Any] = {float: np.float64, int: np.int64, bool: np.bool_}
_ARRAYS: dict[Any, Any] = {NDArray[np.float64]: np.float64, NDArray[np.int64]: np.int64}


class _Number:
    """A field of a record that is one number or truth value, as Python sees it."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __get__(self, record: Record | None, owner: type) -> Any:
        return self if record is None else record.views[self._name].item()

    def __set__(self, record: Record, value: Any) -> None:
        record.views[self._name][...] = value


class Record:
    """State with named fields in one block of memory: attributes for Python, a structure for kernels.

    A subclass declares its fields: ``float``, ``int``, ``bool``, with a default where that is not zero;
    ``Annotated[NDArray[np.float64], n, m]`` (or ``np.int64``) for an array of that shape; or another record. Kernels
    are given `array` and see the fields of its one element::

        class Wheels(Record):
            rate_radps: Annotated[NDArray[np.float64], 2]
            still: bool = True

        @kernel
        def turn(wheels: Sequence[Wheels]) -> None:
            wheels[0].still = wheels[0].rate_radps[0] == 0.0

        wheels = Wheels()
        turn(wheels.array)

    Kernels pass it on as it is, or its element: unlike arrays, elements are not counted by reference.
    """

    dtype: np.dtype[np.void]
    _whole: tuple[Record, str] | None = None  # that it is a part of, and as what
    _defaults: dict[str, Any]
    _records: dict[str, type[Record]]

    def __init_subclass__(cls) -> None:
        """Lay the fields out in memory."""
        hints = get_type_hints(cls, include_extras=True)
        names = [name for name in cls.__annotations__ if not name.startswith("_")]
        cls._defaults = {name: cls.__dict__[name] for name in names if name in cls.__dict__}
        cls._records, fields = {}, list[Any]()
        for name in names:
            hint = hints[name]
            if get_origin(hint) is Annotated:
                kind, *shape = get_args(hint)
                fields.append((name, _ARRAYS[kind], tuple(shape)))
            elif hint in _SCALARS:
                fields.append((name, _SCALARS[hint]))
                setattr(cls, name, _Number(name))
            else:
                cls._records[name] = hint
                fields.append((name, hint.dtype))
        cls.dtype = np.dtype(fields, align=True)

    def __init__(self, **values: Any) -> None:
        """A record with these values, and the defaults for all other fields."""
        self._lie_in(np.zeros(1, self.dtype))
        self.reset(**values)

    def _lie_in(self, array: NDArray[np.void]) -> None:
        """Use this memory, (1,) of `dtype`, for the fields."""
        self._array = array
        self.views: dict[str, NDArray[Any]] = {}
        for name in self.dtype.names or ():
            if name in self._records:
                part = self._records[name].__new__(self._records[name])
                part._lie_in(array[name])
                part._whole = (self, name)
                setattr(self, name, part)
            else:
                self.views[name] = array[name][0, ...]
                if self.views[name].ndim > 0:
                    setattr(self, name, self.views[name])

    def reset(self, **values: Any) -> None:
        """Set these values, and all other fields to their defaults."""
        self._array[:] = np.zeros(1, self.dtype)
        for name in self._records:
            getattr(self, name).reset()
        for name, value in {**self._defaults, **values}.items():
            self.views[name][...] = value

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """A copy with memory of its own; the copy of a part is a part of the copy."""
        if self._whole is not None:
            whole, name = self._whole
            part: Self = getattr(deepcopy(whole, memo), name)
            return part
        copied = type(self)()
        copied._array[:] = self._array
        memo[id(self)] = copied
        return copied

    @property
    def array(self) -> Sequence[Self]:
        """(1,) structured array over the same memory, for kernels."""
        return cast("Sequence[Self]", self._array)
