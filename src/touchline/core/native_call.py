"""Calls of compiled code without Python in between: a function of CPython's C interface for each kernel.

Its text, in LLVM's language, is compiled with the kernel. It unpacks the arguments into the block of words that
`kernel_calls` describes, and makes the result of the words behind them. Offsets are those of CPython's objects and of
NumPy's arrays and scalars, which are part of the binary interfaces of both.
"""

import ctypes
import sysconfig
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from touchline.core.kernel_arguments import ArrayType, RecordType, Tree, TupleType, width
from touchline.core.kernel_code import failure

_TYPE, _TUPLE_SIZE, _TUPLE_ITEMS = 8, 16, tuple.__basicsize__  # 24 bytes; from Python 3.14 on 32
_ARRAY_DATA, _ARRAY_NDIM, _ARRAY_SHAPE, _ARRAY_DTYPE, _ARRAY_FLAGS = 16, 24, 32, 56, 64
_RECORD_DATA, _RECORD_DTYPE = 24, 32
_WRITEABLE_C: Final = 0x0501
"""Flags of an array in C order that is aligned and may be written."""
_FASTCALL: Final = 0x0080
_USABLE: Final = not sysconfig.get_config_var("Py_GIL_DISABLED") and object.__basicsize__ == 16
LAYOUT: Final = _TUPLE_ITEMS if _USABLE else 0
"""Code with such functions is for Pythons of the same layout."""
_OTHERWISE, _FAIL, _NONE, _TYPES = range(4)
"""Places in the tuple that the function has as `self`; the last is the first of `_expected` and `_classes`."""

_TEXT: Final = """
declare double @PyFloat_AsDouble(ptr)
declare double @PyComplex_RealAsDouble(ptr)
declare double @PyComplex_ImagAsDouble(ptr)
declare i64 @PyLong_AsLongLong(ptr)
declare i32 @PyObject_IsTrue(ptr)
declare ptr @PyErr_Occurred()
declare void @PyErr_Clear()
declare ptr @PyFloat_FromDouble(double)
declare ptr @PyLong_FromLongLong(i64)
declare ptr @PyBool_FromLong(i64)
declare ptr @PyComplex_FromDoubles(double, double)
declare ptr @PyTuple_New(i64)
declare i32 @PyTuple_SetItem(ptr, i64, ptr)
declare ptr @PyObject_CallObject(ptr, ptr)
declare ptr @PyObject_Vectorcall(ptr, ptr, i64, ptr)
declare void @Py_IncRef(ptr)
declare void @Py_DecRef(ptr)
declare ptr @PyEval_SaveThread()
declare void @PyEval_RestoreThread(ptr)
define ptr @"{native}"(ptr %self, ptr %args, i64 %count) {{
  %block = alloca [{words} x i64]
  %enough = icmp eq i64 %count, {count}
  br i1 %enough, label %begin, label %other
begin:
  {take}
  %raised = call ptr @PyErr_Occurred()
  %wrong = icmp ne ptr %raised, null
  br i1 %wrong, label %out, label %run
run:
  {unlock}
  %error = call ptr @"{name}"(ptr %block)
  {lock}
  %failed = icmp ne ptr %error, null
  br i1 %failed, label %fail, label %good
good:
  {make}
fail:
  %number = ptrtoint ptr %error to i64
  {fail}
other:
  call void @PyErr_Clear()
  {other}
out:
  ret ptr null
}}
"""


def native_name(name: str) -> str:
    """Return the name of the function for code of this name."""
    return f"{name}.call"


def native_text(name: str, arguments: Sequence[Tree], result: Tree, *, locked: bool) -> str:
    """Return the text of the function for some code; empty if there is none for these types.

    Args:
        name: Name of the code, a function of the address of a block.
        arguments: Types of the kernel's arguments.
        result: Type of its result.
        locked: Whether other threads of Python wait while it runs.
    """
    if not _takes(arguments) or not _makes(result):
        return ""
    text = _NativeText()
    for i, tree in enumerate(arguments):
        text.take(text.load("ptr", "%args", 8 * i), tree)
    words, take = text.words + width(result), text.body()
    text.add(f"ret ptr {text.make(result)}")
    make = text.body()
    number = text.call("ptr", "PyLong_FromLongLong", "i64 %number")
    one = text.call("ptr", "PyTuple_New", "i64 1")
    text.call("i32", "PyTuple_SetItem", f"ptr {one}, i64 0, ptr {number}")
    text.call("ptr", "PyObject_CallObject", f"ptr {text.item(_FAIL)}, ptr {one}")
    text.add(f"call void @Py_DecRef(ptr {one})", "ret ptr null")
    fail = text.body()
    given = f"ptr {text.item(_OTHERWISE)}, ptr %args, i64 %count, ptr null"
    text.add(f"ret ptr {text.call('ptr', 'PyObject_Vectorcall', given)}")
    return _TEXT.format(
        native=native_name(name),
        name=name,
        words=max(words, 1),
        count=len(arguments),
        take=take,
        unlock="" if locked else "%thread = call ptr @PyEval_SaveThread()",
        lock="" if locked else "call void @PyEval_RestoreThread(ptr %thread)",
        make=make,
        fail=fail,
        other=text.body(),
    )


def native_call(
    address: int, arguments: Sequence[Tree], result: Tree, otherwise: Callable[..., Any], makeups: Sequence[Any] = ()
) -> Callable[..., Any]:
    """Make a Python function of a function of that text.

    Args:
        address: Address of it.
        arguments: Types of the kernel's arguments.
        result: Type of its result.
        otherwise: Called instead with arguments of other types.
        makeups: Makeups of the arguments; without them, any numbers are taken for the right ones.
    """
    keys = makeups or [None] * len(arguments)
    expected = [kind for tree, key in zip(arguments, keys, strict=True) for kind in _expected(tree, key)]
    method = _methods.setdefault(address, _Method(b"kernel", address, _FASTCALL, None))
    items = (otherwise, _fail, None, *expected, *_classes(result))
    made: Callable[..., Any] = _new_function(ctypes.addressof(method), items, None)
    return made


def _fail(address: int) -> None:
    raise failure(address)


def _takes(arguments: Sequence[Tree]) -> bool:
    """Return whether arguments can be unpacked: all arrays are in C order, and the layout of objects is known."""
    return _USABLE and all(
        tree.layout == "C" if isinstance(tree, ArrayType) else not isinstance(tree, TupleType) or _takes(tree.parts)
        for tree in arguments
    )


def _makes(result: Tree) -> bool:
    """Return whether a result has no arrays: numbers, None, and tuples of them."""
    return all(map(_makes, result.parts)) if isinstance(result, TupleType) else isinstance(result, str)


def _expected(tree: Tree, key: Any) -> list[Any]:
    """Return what the types of an argument are compared with, in the order of `_NativeText.take`; None for any."""
    if isinstance(tree, TupleType):
        keys = key[1:] if key else [None] * len(tree.parts)
        inner = [kind for part, k in zip(tree.parts, keys, strict=True) for kind in _expected(part, k)]
        return [tree.kind, *inner]
    if isinstance(tree, ArrayType | RecordType):
        return [np.ndarray if isinstance(tree, ArrayType) else np.void, tree.dtype]
    return [key]


def _classes(tree: Tree) -> list[type]:
    """Classes of the named tuples in a result, in the order of `_NativeText.make`."""
    if not isinstance(tree, TupleType):
        return []
    inner = [kind for part in tree.parts for kind in _classes(part)]
    return inner if tree.kind is tuple else [*inner, tree.kind]


class _NativeText:
    """Statements of the function so far, and the number of words that they take."""

    def __init__(self) -> None:
        self.words = 0
        self._lines: list[str] = []
        self._names = 0
        self._items = _TYPES

    def add(self, *lines: str) -> None:
        """Add statements."""
        self._lines += lines

    def body(self) -> str:
        """Return the statements so far, and begin anew."""
        lines, self._lines = self._lines, []
        return "\n  ".join(lines)

    def _let(self, value: str) -> str:
        self._names += 1
        self.add(f"%v{self._names} = {value}")
        return f"%v{self._names}"

    def load(self, kind: str, base: str, offset: int) -> str:
        """Return the value of a type so many bytes behind an address."""
        place = self._let(f"getelementptr i8, ptr {base}, i64 {offset}")
        return self._let(f"load {kind}, ptr {place}")

    def call(self, kind: str, function: str, given: str) -> str:
        """Return the result of a function of CPython's."""
        return self._let(f"call {kind} @{function}({given})")

    def item(self, place: int) -> str:
        """Return an item of `self`."""
        return self.load("ptr", "%self", _TUPLE_ITEMS + 8 * place)

    def shared(self, place: int) -> str:
        """Return an item of `self` with a reference for the caller."""
        item = self.item(place)
        self.add(f"call void @Py_IncRef(ptr {item})")
        return item

    def _next_item(self) -> str:
        self._items += 1
        return self.item(self._items - 1)

    def _demand(self, condition: str) -> None:
        """Go on with `otherwise` unless a condition is true."""
        self._names += 1
        self.add(f"br i1 {condition}, label %l{self._names}, label %other", f"l{self._names}:")

    def _demand_expected(self, found: str) -> None:
        """Go on with `otherwise` unless a type is the next one in `self`, or None is there."""
        expected = self._next_item()
        same = self._let(f"icmp eq ptr {found}, {expected}")
        anything = self._let(f"icmp eq ptr {expected}, {self.item(_NONE)}")
        self._demand(self._let(f"or i1 {same}, {anything}"))

    def _word(self, kind: str, value: str) -> None:
        place = self._let(f"getelementptr i64, ptr %block, i64 {self.words}")
        self.add(f"store {kind} {value}, ptr {place}")
        self.words += 1

    def take(self, value: str, tree: Tree) -> None:
        """Put the words of an argument into the block."""
        self._demand_expected(self.load("ptr", value, _TYPE))
        if isinstance(tree, TupleType):
            self._demand(self._let(f"icmp eq i64 {self.load('i64', value, _TUPLE_SIZE)}, {len(tree.parts)}"))
            for i, part in enumerate(tree.parts):
                self.take(self.load("ptr", value, _TUPLE_ITEMS + 8 * i), part)
        elif isinstance(tree, ArrayType):
            self._take_array(value, tree)
        elif isinstance(tree, RecordType):
            self._demand_expected(self.load("ptr", value, _RECORD_DTYPE))
            self._word("ptr", self.load("ptr", value, _RECORD_DATA))
        elif tree == "complex128":
            for part in ("Real", "Imag"):
                self._word("double", self.call("double", f"PyComplex_{part}AsDouble", f"ptr {value}"))
        elif tree == "float64":
            self._word("double", self.call("double", "PyFloat_AsDouble", f"ptr {value}"))
        elif tree == "bool":
            self._word("i64", self._let(f"sext i32 {self.call('i32', 'PyObject_IsTrue', f'ptr {value}')} to i64"))
        elif tree == "int64":
            self._word("i64", self.call("i64", "PyLong_AsLongLong", f"ptr {value}"))

    def _take_array(self, value: str, tree: ArrayType) -> None:
        self._demand_expected(self.load("ptr", value, _ARRAY_DTYPE))
        self._demand(self._let(f"icmp eq i32 {self.load('i32', value, _ARRAY_NDIM)}, {tree.ndim}"))
        flags = self._let(f"and i32 {self.load('i32', value, _ARRAY_FLAGS)}, {_WRITEABLE_C}")
        self._demand(self._let(f"icmp eq i32 {flags}, {_WRITEABLE_C}"))
        self._word("ptr", self.load("ptr", value, _ARRAY_DATA))
        shape = self.load("ptr", value, _ARRAY_SHAPE)
        for axis in range(tree.ndim):
            self._word("i64", self.load("i64", shape, 8 * axis))

    def make(self, tree: Tree) -> str:
        """Return a new object of the next words in the block."""
        if isinstance(tree, TupleType):
            return self._make_tuple(tree)
        if tree == "none":
            return self.shared(_NONE)
        first = self._next_word("i64" if tree in ("int64", "bool") else "double")
        if tree == "complex128":
            return self.call("ptr", "PyComplex_FromDoubles", f"double {first}, double {self._next_word('double')}")
        if tree == "float64":
            return self.call("ptr", "PyFloat_FromDouble", f"double {first}")
        return self.call("ptr", "PyBool_FromLong" if tree == "bool" else "PyLong_FromLongLong", f"i64 {first}")

    def _next_word(self, kind: str) -> str:
        self.words += 1
        return self.load(kind, "%block", 8 * (self.words - 1))

    def _make_tuple(self, tree: TupleType) -> str:
        made = self.call("ptr", "PyTuple_New", f"i64 {len(tree.parts)}")
        for i, part in enumerate(tree.parts):
            self.call("i32", "PyTuple_SetItem", f"ptr {made}, i64 {i}, ptr {self.make(part)}")
        if tree.kind is tuple:
            return made
        named = self.call("ptr", "PyObject_CallObject", f"ptr {self._next_item()}, ptr {made}")
        self.add(f"call void @Py_DecRef(ptr {made})")
        return named


class _Method(ctypes.Structure):
    """CPython's PyMethodDef."""

    _fields_ = (
        ("name", ctypes.c_char_p),
        ("function", ctypes.c_void_p),
        ("flags", ctypes.c_int),
        ("text", ctypes.c_char_p),
    )


_methods: dict[int, _Method] = {}
"""By address; the functions made of them refer to them."""
_new_function: Final = ctypes.pythonapi.PyCFunction_NewEx
_new_function.restype, _new_function.argtypes = ctypes.py_object, [ctypes.c_void_p, ctypes.py_object, ctypes.c_void_p]
