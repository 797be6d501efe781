"""Calls of compiled code: what puts the arguments into a block of memory, and takes the result from there.

The code takes one argument, the address of a block of 64-bit words: numbers, and of each array the address and the
shape. It leaves its result behind them. The functions here are made for given types, as text: a kernel is called
thousands of times a second.
"""

import ctypes
import struct
import weakref
from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from touchline.core.kernel_arguments import FORMATS, ArrayType, RecordType, Tree, TupleType, makeup, width
from touchline.core.kernel_code import failure

Run = Callable[[int], int | None]
Words = tuple[str, list[str]]
#: Arrays of more are not held between calls.
_HELD_BYTES: Final = 4096


MISS: Final = object()
"""Result of a call that is made for arguments of other types."""


def made_call(run: Run, arguments: Sequence[Tree], result: Tree, makeups: Sequence[Any] = ()) -> Callable[..., Any]:
    """A function that calls the code, from any thread.

    A tuple or record that is the same object as in the last call is taken for unchanged, and not looked at again.

    Args:
        run: The code.
        arguments: Their types.
        result: Its type.
        makeups: Those of the arguments; the function then returns MISS if it is given others. Without them it takes
            the types for granted.
    """
    text = _Text()
    guards: list[str] = []
    last = 2  # in the block, behind memory and address
    fresh = _Put(0)
    at = 0
    for i, tree in enumerate(arguments):
        name, kept = f"a{i}", isinstance(tree, TupleType | ArrayType)
        if makeups:
            guard = text.guard(name, makeups[i], tree)
            guards.append(f"({name} is block[{last}] or {guard})" if kept else guard)
        if kept and width(tree):
            text.put(fresh)
            fresh = _Put(at + width(tree))
            text.put(_Put(at, *text.words(tree, name)), name, last)
        else:
            form, words = text.words(tree, name)
            fresh = fresh._replace(form=fresh.form + form, words=[*fresh.words, *words])
        last += kept
        at += width(tree)
    text.put(fresh)
    packing = text.body()
    text.add("block = free.pop() if free else new()")
    if guards:
        text.add(f"if not ({' and '.join(guards)}):", "    free.append(block)", "    return miss")
    text.add(*packing, "error = run(block[1])", "if error: raise failure(error)")
    text.add(f"value = {text.value(result, 8 * at)}", "free.append(block)", "return value")
    size = 8 * max(at + width(result), 1)

    def new() -> list[Any]:
        memory = ctypes.create_string_buffer(size)
        block: list[Any] = [memory, ctypes.addressof(memory)]
        return block + [block] * (last - 2)

    given = ", ".join(f"a{i}" for i in range(len(arguments)))
    return text.function(given, run=run, free=[], new=new, miss=MISS)


class _Put(NamedTuple):
    """Words that are put into the block at once: the number of the first, their format and expressions."""

    first: int
    form: str = ""
    words: Sequence[str] = ()


class _Text:
    """The text of a function, and the names in it."""

    def __init__(self) -> None:
        self.taken: list[str] = []
        self._lines: list[str] = []
        self._names: dict[str, Any] = {
            "address_of": ctypes.addressof,
            "array": np.ndarray,
            "byte": ctypes.c_char.from_buffer,
            "failure": failure,
            "large": _is_large,
            "makeup": makeup,
            "record_address": _record_address,
            "take": _take,
            "truth": bool,
        }

    def add(self, *lines: str) -> None:
        """Add lines of the body."""
        self._lines += lines

    def body(self) -> list[str]:
        """The lines so far, which are taken out."""
        lines, self._lines = self._lines, []
        return lines

    def put(self, put: _Put, value: str = "", last: int = 0) -> None:
        """Add the lines that put words into the block: those of `value` only if it is not the one of the last call.

        Large arrays are not held for that. Of an array that nobody may write there is a copy, which would not follow
        its owner's changes.
        """
        taken, self.taken = self.taken, []
        if not put.words:
            return
        pack = self._named(struct.Struct(f"={put.form}").pack_into)
        lines = [*taken, f"{pack}(block[0], {8 * put.first}, {', '.join(put.words)})"]
        if value:
            lines = ["kept = ()", *lines, f"block[{last}] = block if kept or large({value}) else {value}"]
            lines = [f"if {value} is not block[{last}]:", *(f"    {line}" for line in lines)]
        self.add(*lines)

    def function(self, given: str, **names: Any) -> Callable[..., Any]:
        """The function with these parameters."""
        names |= self._names
        exec("\n    ".join((f"def call({given}):", *self._lines)), names)
        made: Callable[..., Any] = names["call"]
        return made

    def guard(self, value: str, key: Any, tree: Tree) -> str:
        """The condition that a value is of a makeup."""
        if isinstance(tree, str):
            return f"type({value}) is {self._named(key)}"
        if isinstance(tree, TupleType):
            kind, *keys = key
            parts = [self.guard(f"{value}[{i}]", *part) for i, part in enumerate(zip(keys, tree.parts, strict=True))]
            return " and ".join((f"type({value}) is {self._named(kind)} and len({value}) == {len(keys)}", *parts))
        if isinstance(tree, ArrayType) and key[2] is True:  # as most are
            same = f"{value}.dtype is {self._named(tree.dtype)} and {value}.ndim == {tree.ndim}"
            return f"type({value}) is array and {same} and {value}.flags.carray"
        return f"makeup({value}) == {self._named(key)}"

    def _named(self, value: Any) -> str:
        name = f"n{len(self._names)}"
        self._names[name] = value
        return name

    def words(self, tree: Tree, value: str) -> Words:
        """The format and the expressions of a value's words; what has to be done before goes to `taken`."""
        if isinstance(tree, TupleType):
            parts = [self.words(part, f"{value}[{i}]") for i, part in enumerate(tree.parts)]
            return "".join(form for form, _ in parts), [word for _, words in parts for word in words]
        if isinstance(tree, RecordType):
            return "q", [f"array((1,), {value}.dtype, {value}).ctypes.data"]
        if isinstance(tree, ArrayType):
            return "q" * width(tree), self._array_words(tree, value)
        if tree == "complex128":
            return "dd", [f"{value}.real", f"{value}.imag"]
        return FORMATS[tree], [] if tree == "none" else [f"truth({value})" if tree == "bool" else value]

    def _array_words(self, tree: ArrayType, value: str) -> list[str]:
        name = f"v{len(self.taken)}_{len(self._names)}"
        self._names[name] = None
        copy = f"{name} = {name}.copy('K'); kept += ({name},)"
        self.taken += [f"{name} = {value}", f"if not {name}.flags.writeable: {copy}"]
        shape = [f"*{name}.shape"]
        if tree.layout == "A":
            return [f"{name}.ctypes.data", *shape, f"*{name}.strides"]
        if tree.dtype.names:
            return [f"record_address({name})", *shape]
        if tree.layout == "F":
            return [f"{name}.ctypes.data", *shape]
        return [f"address_of(byte({name})) if {name}.size else 0", *shape]

    def value(self, tree: Tree, offset: int) -> str:
        """The expression for a value whose words begin at an offset in the memory; they are read before."""
        forms: list[str] = []
        expression = self._read(tree, forms)
        if forms:
            self.add(f"w = {self._named(struct.Struct('=' + ''.join(forms)).unpack_from)}(block[0], {offset})")
        return expression

    def _read(self, tree: Tree, forms: list[str]) -> str:
        """The expression for a value from the words `w`, those that have the formats so far being taken."""

        def word(form: str) -> str:
            forms.append(form)
            return f"w[{len(forms) - 1}]"

        if isinstance(tree, TupleType):
            parts = [self._read(part, forms) for part in tree.parts]
            if tree.kind is tuple:
                return f"({''.join(f'{part}, ' for part in parts)})"
            return f"{self._named(tree.kind)}({', '.join(parts)})"
        if isinstance(tree, ArrayType):
            address, shape = word("q"), "".join(f"{word('q')}, " for _ in range(tree.ndim))
            return f"take({address}, ({shape}), {self._named(tree.dtype)})"
        if tree == "complex128":
            return f"complex({word('d')}, {word('d')})"
        if tree == "bool":
            return f"truth({word('q')})"
        return "None" if tree == "none" else word(FORMATS[tree])  # type: ignore[index]


def _is_large(value: Any) -> bool:
    """Return whether something is an array of numbers that is too large to be held between calls."""
    return type(value) is np.ndarray and value.nbytes > _HELD_BYTES and not value.dtype.names


_known: dict[int, tuple[Any, int]] = {}


def _record_address(records: Any) -> int:
    """The address of a structured array, which takes long to find; remembered as long as there is the array."""
    found = _known.get(id(records))
    if found is not None and found[0]() is records:
        return found[1]
    key, address = id(records), records.ctypes.data
    _known[key] = weakref.ref(records, lambda _: _known.pop(key, None)), address
    return int(address)


_free = ctypes.CDLL(None).free
_free.argtypes, _free.restype = [ctypes.c_void_p], None


def _take(address: int, shape: tuple[int, ...], dtype: "np.dtype[Any]") -> Any:
    """A copy of an array that compiled code left in memory of its own, which is given back."""
    size = dtype.itemsize
    for length in shape:
        size *= length
    found = np.frombuffer(ctypes.string_at(address, size), dtype).reshape(shape).copy()
    _free(address)
    return found
