"""Batches: many calls of compiled kernels, each with its own arguments, in one call from Python.

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
define ptr @"{_NAME}"(ptr %condition, i64 %width, ptr %code, ptr %blocks, i64 %count) {{
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
  %answer = getelementptr i8, ptr %block, i64 %width
  %rest = getelementptr i8, ptr %answer, i64 8
  br i1 %none, label %done, label %ask
ask:
  %unasked = call ptr %condition(ptr %block)
  %asked = icmp eq ptr %unasked, null
  br i1 %asked, label %decide, label %failed
decide:
  %answered = load i64, ptr %answer
  %no = icmp eq i64 %answered, 0
  br i1 %no, label %done, label %run
run:
  %error = call ptr %code(ptr %rest)
  %good = icmp eq ptr %error, null
  br i1 %good, label %ask, label %failed
done:
  br label %next
failed:
  %problem = phi ptr [%unasked, %ask], [%error, %run]
  ret ptr %problem
end:
  ret ptr null
}}
"""
_Loop: Final = ctypes.CFUNCTYPE(
    ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64
)


@cache
def _loop() -> Any:
    """The function that calls code for each block while the condition holds; other threads go on meanwhile."""
    import llvmlite.binding as llvm  # here: it takes as long as a start

    address_of = load(target_machine().emit_object(llvm.parse_assembly(_TEXT)), _NAME)
    return _Loop(address_of(_NAME))


class KernelBatch:
    """Calls of a kernel, by index, each repeated while a condition holds.

    The kernels stay apart: a condition that called a large kernel would hold, and compile, all of it once more.
    """

    def __init__(self, condition: Kernel, kernel: Kernel, count: int) -> None:
        """Make room for so many calls; none is set.

        Args:
            condition: Kernel that returns whether to call the other one, and is asked before each call of that.
            kernel: Kernel that returns nothing.
            count: Number of calls.
        """
        self._condition, self._kernel = condition, kernel
        self._kept: list[tuple[Any, ...] | None] = [None] * count
        self._blocks: list[Any] = [None] * count
        self._addresses = np.zeros(count, dtype=np.int64)
        self._place = self._addresses.ctypes.data
        self._code = (0, 0, 0)

    def set(self, index: int, condition: tuple[Any, ...], arguments: tuple[Any, ...]) -> None:
        """Set the arguments of the condition and of the kernel, which are of the same types in all calls.

        Numbers are taken as they are now.
        """
        asked = _words(tree_of(condition), condition)
        if not any(self._code):
            self._code = self._condition.address(condition), len(asked), self._kernel.address(arguments)
        words = asked + bytes(8) + _words(tree_of(arguments), arguments)
        if self._blocks[index] is None:
            self._blocks[index] = ctypes.create_string_buffer(len(words))
        ctypes.memmove(self._blocks[index], words, len(words))
        self._kept[index] = condition, arguments
        self._addresses[index] = ctypes.addressof(self._blocks[index])

    def clear(self, index: int) -> None:
        """Leave a call out until it is set again."""
        self._kept[index], self._addresses[index] = None, 0

    def run(self, first: int, last: int) -> None:
        """Run the calls from `first` to before `last`; several threads may run different ones at once."""
        if any(self._code):
            error = _loop()(*self._code, self._place + 8 * first, last - first)
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
