"""Calls of compiled code: what puts the arguments into a block of memory, and takes the result from there.

The code takes one argument, the address of a block of 64-bit words: numbers, and of each array the address and the
shape. It leaves its result behind them. The functions here are made for given types, as text: a kernel is called
thousands of times a second.
"""

import ctypes
import struct
import weakref
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from touchline.core.kernel_arguments import FORMATS, ArrayType, RecordType, Tree, TupleType, width
from touchline.core.kernel_code import failure

Run = Callable[[int], int | None]
Words = tuple[str, list[str]]


def call_from_anywhere(run: Run, arguments: Sequence[Tree], result: Tree) -> Callable[..., Any]:
    """A function that calls the code, from any thread.

    Args:
        run: The code.
        arguments: Their types; the function takes no others.
        result: Its type.
    """
    text = _Text()
    given = [f"a{i}" for i in range(len(arguments))]
    packed = [text.words(tree, name) for tree, name in zip(arguments, given, strict=True)]
    first = sum(map(width, arguments))
    text.add("block = free.pop() if free else new()", "memory, address = block", *text.taken)
    words = [word for _, each in packed for word in each]
    text.add(f"{text.packer(''.join(form for form, _ in packed))}(memory, 0, {', '.join(words)})")
    text.add("error = run(address)", "if error: raise failure(error)")
    text.add(f"value = {text.value(result, 8 * first)}", "free.append(block)", "return value")
    size = 8 * max(first + width(result), 1)
    return text.function(", ".join(given), run=run, free=[], new=lambda: _block(size))


def call_from_one_place(run: Run, arguments: Sequence[Tree], result: Tree) -> Callable[..., Any]:
    """As `call_from_anywhere`, for one thread at a time.

    An argument that is the same object as in the last call is taken for unchanged, and not looked at again.
    """
    text = _Text()
    at = 0
    for i, tree in enumerate(arguments):
        if width(tree):
            text.taken = []
            form, words = text.words(tree, f"a{i}")
            body = [*text.taken, f"{text.packer(form)}(memory, {8 * at}, {', '.join(words)})"]
            # Of an array that nobody may write there is a copy, which would not follow its owner's changes.
            text.add(f"if a{i} is not last[{i}]:", "    kept = ()", *(f"    {line}" for line in body))
            text.add(f"    last[{i}], copies[{i}] = (last if kept else a{i}), kept")
        at += width(tree)
    text.add("error = run(address)", "if error: raise failure(error)")
    text.add(f"return {text.value(result, 8 * at)}")
    memory, address = _block(8 * max(at + width(result), 1))
    none = [None] * len(arguments)
    given = ", ".join(f"a{i}" for i in range(len(arguments)))
    return text.function(given, run=run, memory=memory, address=address, last=[none] * len(none), copies=none)


class _Text:
    """The text of a function, and the names in it."""

    def __init__(self) -> None:
        self.taken: list[str] = ["kept = ()"]
        self._lines: list[str] = []
        self._names: dict[str, Any] = {
            "address_of": ctypes.addressof,
            "array": np.ndarray,
            "byte": ctypes.c_char.from_buffer,
            "failure": failure,
            "record_address": _record_address,
            "take": _take,
            "truth": bool,
        }

    def add(self, *lines: str) -> None:
        """Add lines of the body."""
        self._lines += lines

    def function(self, given: str, **names: Any) -> Callable[..., Any]:
        """The function with these parameters."""
        names |= self._names
        exec("\n    ".join((f"def call({given}):", *self._lines)), names)
        made: Callable[..., Any] = names["call"]
        return made

    def _named(self, value: Any) -> str:
        name = f"n{len(self._names)}"
        self._names[name] = value
        return name

    def packer(self, form: str) -> str:
        """The name of a function that writes words of that format."""
        return self._named(struct.Struct(f"={form}").pack_into)

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
            self.add(f"w = {self._named(struct.Struct('=' + ''.join(forms)).unpack_from)}(memory, {offset})")
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


def _block(size: int) -> tuple[Any, int]:
    """Memory of that size and its address."""
    memory = ctypes.create_string_buffer(size)
    return memory, ctypes.addressof(memory)


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
