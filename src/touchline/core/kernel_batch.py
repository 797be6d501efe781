"""Batches: many calls of one kernel, each with its own arguments, in one call from Python.

The words of the arguments (`kernel_calls`) are put into memory beforehand, so nothing is unpacked between the calls.
"""

import ctypes
import struct
from functools import cache
from typing import Any, Final

import numpy as np

from touchline.core.jit import Kernel
from touchline.core.kernel_arguments import FORMATS, ArrayType, RecordType, Tree, TupleType, tree_of, width
from touchline.core.kernel_code import failure, load, target_machine

_NAME: Final = "touchline_batch"
_TEXT: Final = f"""
define ptr @"{_NAME}"(ptr %code, ptr %blocks, i64 %count) {{
begin:
  br label %next
next:
  %i = phi i64 [0, %begin], [%after, %done]
  %more = icmp slt i64 %i, %count
  br i1 %more, label %look, label %end
look:
  %after = add i64 %i, 1
  %place = getelementptr ptr, ptr %blocks, i64 %i
  %block = load ptr, ptr %place
  %none = icmp eq ptr %block, null
  br i1 %none, label %done, label %run
run:
  %error = call ptr %code(ptr %block)
  %good = icmp eq ptr %error, null
  br i1 %good, label %done, label %failed
done:
  br label %next
failed:
  ret ptr %error
end:
  ret ptr null
}}
"""
_Loop: Final = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64)


@cache
def _loop() -> Any:
    """The function that calls code for each block; other threads go on meanwhile."""
    import llvmlite.binding as llvm  # here: it takes as long as a start

    address_of = load(target_machine().emit_object(llvm.parse_assembly(_TEXT)), _NAME)
    return _Loop(address_of(_NAME))


class KernelBatch:
    """Calls of a kernel that returns nothing, by index."""

    def __init__(self, kernel: Kernel, count: int) -> None:
        """Make room for so many calls; none is set."""
        self._kernel = kernel
        self._kept: list[tuple[Any, ...] | None] = [None] * count
        self._blocks: list[Any] = [None] * count
        self._addresses = np.zeros(count, dtype=np.int64)
        self._place = self._addresses.ctypes.data
        self._code = 0

    def set(self, index: int, arguments: tuple[Any, ...]) -> None:
        """Set the arguments of a call, which are of the same types in all calls; numbers are taken as they are now."""
        trees = list(map(tree_of, arguments))
        if not self._code:
            self._code = self._kernel.address(arguments)
        words = b"".join(_words(tree, value) for tree, value in zip(trees, arguments, strict=True))
        if self._blocks[index] is None:
            self._blocks[index] = ctypes.create_string_buffer(len(words))
        ctypes.memmove(self._blocks[index], words, len(words))
        self._kept[index] = arguments
        self._addresses[index] = ctypes.addressof(self._blocks[index])

    def clear(self, index: int) -> None:
        """Leave a call out until it is set again."""
        self._kept[index], self._addresses[index] = None, 0

    def run(self, first: int, last: int) -> None:
        """Run the calls from `first` to before `last`; several threads may run different ones at once."""
        if self._code:
            error = _loop()(self._code, self._place + 8 * first, last - first)
            if error:
                raise failure(error)


def _words(tree: Tree, value: Any) -> bytes:
    """The words of an argument."""
    if isinstance(tree, TupleType):
        return b"".join(_words(part, each) for part, each in zip(tree.parts, value, strict=True))
    if isinstance(tree, RecordType):
        raise TypeError("a batch takes arrays of records, not their elements")
    if isinstance(tree, ArrayType):
        if tree.layout != "C":
            raise TypeError("a batch takes arrays in C order")
        return struct.pack(f"={width(tree)}q", value.ctypes.data, *value.shape)
    return struct.pack(f"={FORMATS[tree]}", *(() if tree == "none" else (value,)))
