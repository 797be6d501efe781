"""Types of a kernel's arguments, as trees, and how many 64-bit words a value of each takes."""

from collections.abc import Iterator
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np

_SCALARS: Final = {
    int: "int64",
    np.int64: "int64",
    bool: "bool",
    np.bool_: "bool",
    float: "float64",
    np.float64: "float64",
    complex: "complex128",
    np.complex128: "complex128",
    type(None): "none",
}
#: Formats of the words of a number, as the module `struct` has them.
FORMATS: Final = {"int64": "q", "bool": "q", "float64": "d", "complex128": "dd", "none": ""}
_KEPT: dict[int, Any] = {}


class UnsupportedArgumentError(TypeError):
    """An argument, or a result, that does not fit into words: Numba has to deal with it itself."""


class ArrayType(NamedTuple):
    """An array; `layout` is "C", "F" or, for strided ones, "A"."""

    dtype: "np.dtype[Any]"
    ndim: int
    layout: str

    def __str__(self) -> str:
        return f"{self.dtype!r}[{self.ndim}{self.layout}]"


class RecordType(NamedTuple):
    """One element of a structured array."""

    dtype: "np.dtype[Any]"

    def __str__(self) -> str:
        return repr(self.dtype)


class TupleType(NamedTuple):
    """A tuple, or a named one of a class."""

    kind: type
    parts: "tuple[Tree, ...]"

    def __str__(self) -> str:
        return f"{self.kind.__module__}:{self.kind.__qualname__}({', '.join(map(str, self.parts))})"


Tree: TypeAlias = str | ArrayType | RecordType | TupleType


def makeup(value: Any) -> Any:
    """A key for the type of a value: equal ones have the same type; working that out takes much longer."""
    kind = type(value)
    if kind is np.ndarray:
        flags, dtype = value.flags, value.dtype
        _KEPT.setdefault(id(dtype), dtype)  # so that no other one gets its id
        return id(dtype), value.ndim, flags.carray or (flags.c_contiguous, flags.f_contiguous, flags.writeable)
    if isinstance(value, tuple):
        return kind, *map(makeup, value)
    if kind is np.void:
        _KEPT.setdefault(id(value.dtype), value.dtype)
        return kind, id(value.dtype)
    return kind


def writeable(key: Any) -> bool:
    """Return whether all arrays of this makeup are aligned, in C order and may be written."""
    if not isinstance(key, tuple):
        return True
    return key[2] is True if isinstance(key[0], int) else all(map(writeable, key[1:] if key[0] is not np.void else ()))


def tree_of(value: Any) -> Tree:
    """The type of a value.

    Raises:
        UnsupportedArgumentError: It is none of these.
    """
    if isinstance(value, np.ndarray) and value.ndim > 0:
        flags = value.flags
        if not flags.aligned:
            raise UnsupportedArgumentError("a kernel is given an array that is not aligned")
        return ArrayType(value.dtype, value.ndim, "C" if flags.c_contiguous else "F" if flags.f_contiguous else "A")
    if isinstance(value, tuple):
        return TupleType(type(value), tuple(map(tree_of, value)))
    if type(value) is np.void and value.dtype.names:
        return RecordType(value.dtype)
    found = _SCALARS.get(type(value))
    if found is None:
        raise UnsupportedArgumentError(f"a kernel is given {type(value).__name__}")
    return found


def classes_of(tree: Tree) -> Iterator[type]:
    """The classes of the named tuples in a type."""
    if isinstance(tree, TupleType):
        if tree.kind is not tuple:
            yield tree.kind
        for part in tree.parts:
            yield from classes_of(part)


def width(tree: Tree) -> int:
    """The number of words of a value."""
    if isinstance(tree, TupleType):
        return sum(map(width, tree.parts))
    if isinstance(tree, ArrayType):
        return 1 + tree.ndim * (2 if tree.layout == "A" else 1)
    return 1 if isinstance(tree, RecordType) else len(FORMATS[tree])
