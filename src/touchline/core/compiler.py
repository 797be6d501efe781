"""Compiles kernels with Numba: the only module that knows it, imported only when code is missing.

A kernel becomes the machine code of one function, which takes the address of a block of words (`kernel_arguments`),
rebuilds the arguments from it, calls the kernel and leaves the result behind them. The code needs nothing of Numba or
Python but `malloc` and `free`: Numba's runtime is replaced by another (`kernel_runtime`).

Most kernels are called by other kernels only, whose code then holds theirs. Numba's public dispatcher would optimise
each of them together with all that it calls, make it into machine code and wrap it for Python, and once more for every
constant that it is called with: half of the time. Therefore parts are compiled through its compiler's own
interface (`_Part`, `_Dispatcher`), simplified each for itself, and optimised once, in the code of a kernel that Python
calls. These two classes use all of Numba's private names that are needed, and hold for the versions in pyproject.toml.
"""

import ctypes
import gc
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, Final

import llvmlite.binding as llvm
import numpy as np
from numba import carray, farray  # type: ignore[attr-defined]
from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Flags, compile_extra
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import CPUDispatcher
from numba.core.typing.templates import make_concrete_template
from numba.extending import intrinsic, typeof_impl
from numba.np.numpy_support import as_dtype, from_dtype

from touchline.core.kernel_arguments import ArrayType, RecordType, Tree, TupleType, UnsupportedArgumentError, width
from touchline.core.kernel_code import target_machine
from touchline.core.kernel_function import ClassFunction, KernelFunction
from touchline.core.kernel_passes import optimise, simplify
from touchline.core.kernel_runtime import CALL, RUNTIME
from touchline.core.native_call import native_name, native_text

# So many new objects between two collections: compiling makes a great many, hardly any of which are garbage then.
_OBJECTS = 100_000

_SCALAR_TYPES: Final = {
    "int64": types.int64,
    "bool": types.boolean,
    "float64": types.float64,
    "complex128": types.complex128,
    "none": types.none,
}
_RESULTS: Final = {
    types.int64: "int64",
    types.boolean: "bool",
    types.float64: "float64",
    types.complex128: "complex128",
    types.none: "none",
}


class _Part(JITCodeLibrary):
    """Code of one function, to be linked into that of the kernels that Python calls, which is optimised as a whole.

    Attributes:
        module: The function's code, simplified.
        callees: Libraries with the functions that it calls.
    """

    def __init__(self, codegen: Any, name: str) -> None:
        super().__init__(codegen, name)  # type: ignore[no-untyped-call]
        self.module = llvm.parse_assembly("")
        self.callees: list[Any] = []

    def add_ir_module(self, ir_module: Any) -> None:
        """Add code of the function."""
        module = llvm.parse_assembly(str(ir_module))
        simplify(module)
        self.module.link_in(module)

    def add_linking_library(self, library: Any) -> None:
        """Add a library with a function that it calls; one of Numba's is optimised and complete thereafter."""
        self.callees.append(library)
        if not isinstance(library, _Part):
            super().add_linking_library(library)  # type: ignore[no-untyped-call]

    def finalize(self) -> None:
        """Link the code with all that it calls, for a function that Numba's own dispatcher compiles."""
        self.add_llvm_module(self.module.clone())  # type: ignore[no-untyped-call]
        for callee in self.callees:
            super().add_linking_library(callee)  # type: ignore[no-untyped-call]
        super().finalize()  # type: ignore[no-untyped-call]

    def _finalize_final_module(self) -> None:
        self._finalized = True


class _Dispatcher(CPUDispatcher):
    """A kernel as Numba sees it in other kernels."""

    def __init__(self, kernel: KernelFunction) -> None:
        options = {"nopython": True, "nogil": not kernel.locked, "error_model": "numpy", "_nrt": kernel.counting}
        super().__init__(kernel.py_func, targetoptions=options)
        self._parts: dict[tuple[Any, ...], Any] = {}

    def part(self, general: tuple[Any, ...]) -> Any:
        """The code for arguments of these types, to be linked into a caller's."""
        if general not in self._parts:
            self._parts[general] = self._compile_part(general)
        return self._parts[general]

    def get_call_template(self, args: Any, kws: Any) -> tuple[Any, ...]:
        """Signature that fits, which Numba asks for when it types a call in another kernel."""
        parameters, folded = self.fold_argument_types(args, kws)
        general = tuple(map(types.unliteral, folded))
        name = self.py_func.__name__
        return make_concrete_template(name, name, [self.part(general).signature]), parameters, general, {}

    def get_overload(self, sig: Any) -> Any:
        """The key under which Numba finds the code for that call; `sig` are the types of its arguments."""
        return self._parts[tuple(sig)].library

    def _compile_part(self, args: tuple[Any, ...]) -> Any:
        context: Any = self.targetctx
        flags: Any = Flags()
        self.targetdescr.options.parse_as_flags(flags, self.targetoptions)
        flags.no_compile = flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
        library = _Part(context.codegen(), self.py_func.__qualname__)
        part = compile_extra(self.typingctx, context, self.py_func, args, None, flags, {}, library)
        context.insert_user_function(library, part.fndesc, [library])
        return part


class _ClassDispatcher(CPUDispatcher):
    """Dispatches to the kernel of its name in the class of its first argument, when its caller is compiled."""

    def __init__(self, kernel: ClassFunction) -> None:
        super().__init__(kernel.py_func, targetoptions={"nopython": True})
        self._kernel = kernel

    def _meant(self, first: Any) -> Any:
        return dispatcher_of(self._kernel.meant(first.instance_class))

    def get_call_template(self, args: Any, kws: Any) -> tuple[Any, ...]:
        """As for the kernel that is meant."""
        found: tuple[Any, ...] = self._meant(args[0]).get_call_template(args, kws)
        return found

    def get_overload(self, sig: Any) -> Any:
        """As for the kernel that is meant."""
        return self._meant(sig[0]).get_overload(sig)


def dispatcher_of(kernel: KernelFunction) -> Any:
    """The kernel as Numba sees it."""
    if kernel.dispatcher is None:
        kernel.dispatcher = _ClassDispatcher(kernel) if isinstance(kernel, ClassFunction) else _Dispatcher(kernel)
    return kernel.dispatcher


@typeof_impl.register(KernelFunction)
def _(kernel: KernelFunction, _context: object) -> Any:
    return types.Dispatcher(dispatcher_of(kernel))


@intrinsic
def _pointer(_context: object, _address: object) -> Any:
    """The address (int64) as a pointer."""

    def code(context: Any, builder: Any, _signature: object, given: Any) -> Any:
        return builder.inttoptr(given[0], context.get_value_type(types.voidptr))

    return types.voidptr(types.int64), code


@intrinsic
def _address(_context: object, _pointer: object) -> Any:
    """A pointer as an address (int64)."""

    def code(context: Any, builder: Any, _signature: object, given: Any) -> Any:
        return builder.ptrtoint(given[0], context.get_value_type(types.int64))

    return types.int64(types.voidptr), code


_process: Final = ctypes.CDLL(None)
_malloc = types.ExternalFunction("malloc", types.voidptr(types.int64))


def compile_code(kernel: KernelFunction, arguments: Sequence[Tree], name: str) -> tuple[bytes, Tree]:
    """Compile a kernel for arguments of these types.

    Args:
        kernel: The kernel.
        arguments: Their types.
        name: Of the function in the code.

    Returns:
        The code, an object file, and the type of the result.

    Raises:
        UnsupportedArgumentError: The result does not fit into words.
    """
    with global_compiler_lock:
        often = gc.get_threshold()
        gc.set_threshold(_OBJECTS, *often[1:])
        try:
            result = _result(dispatcher_of(kernel).part(tuple(map(_type, arguments))).signature.return_type)
            entry = KernelFunction(_entry(kernel, arguments, result))
            text = native_text(name, arguments, result, locked=kernel.locked)
            return _emitted(dispatcher_of(entry).part((types.voidptr,)), name, text), result
        finally:
            gc.set_threshold(*often)


def _type(tree: Tree) -> Any:
    """A type as Numba has it."""
    if isinstance(tree, TupleType):
        return types.BaseTuple.from_types([_type(part) for part in tree.parts], tree.kind)
    if isinstance(tree, ArrayType):
        made: Any = types.Array
        return made(from_dtype(tree.dtype), tree.ndim, tree.layout)
    return from_dtype(tree.dtype) if isinstance(tree, RecordType) else _SCALAR_TYPES[tree]


def _result(kind: Any) -> Tree:
    """A type of Numba's as a tree."""
    kind = types.unliteral(kind)
    if isinstance(kind, types.BaseTuple):
        named: Any = kind
        made = named.instance_class if isinstance(kind, types.BaseNamedTuple) else tuple
        return TupleType(made, tuple(map(_result, named)))
    if isinstance(kind, types.Array) and kind.ndim > 0:
        return ArrayType(as_dtype(kind.dtype), kind.ndim, "C")
    if kind not in _RESULTS:
        raise UnsupportedArgumentError(f"a kernel returns {kind}")
    return _RESULTS[kind]


class _Source:
    """The text of an entry function."""

    def __init__(self) -> None:
        self.names: dict[str, Any] = {
            "address": _address,
            "as_strided": np.lib.stride_tricks.as_strided,
            "carray": carray,
            "farray": farray,
            "malloc": _malloc,
            "np": np,
            "pointer": _pointer,
        }
        self.words = 0
        self.lines: list[str] = []

    def _word(self) -> int:
        self.words += 1
        return self.words - 1

    def _named(self, value: object) -> str:
        name = f"c{len(self.names)}"
        self.names[name] = value
        return name

    def argument(self, tree: Tree) -> str:
        """The expression for an argument from the words."""
        if isinstance(tree, TupleType):
            parts = [self.argument(part) for part in tree.parts]
            return f"({''.join(f'{p}, ' for p in parts)})" if tree.kind is tuple else self._made(tree.kind, parts)
        if isinstance(tree, RecordType):
            return f"carray(pointer(i[{self._word()}]), (1,), {self._named(tree.dtype)})[0]"
        if isinstance(tree, ArrayType):
            at, dtype = self._word(), self._named(tree.dtype)
            shape = self._tuple(tree.ndim)
            if tree.layout == "A":
                base = f"carray(pointer(i[{at}]), (1,), {dtype})"
                return f"as_strided({base}, {shape}, {self._tuple(tree.ndim)})"
            return f"{'farray' if tree.layout == 'F' else 'carray'}(pointer(i[{at}]), {shape}, {dtype})"
        if tree == "none":
            return "None"
        at = self._word()
        if tree == "complex128":
            return f"complex(f[{at}], f[{self._word()}])"
        return f"f[{at}]" if tree == "float64" else f"(i[{at}] != 0)" if tree == "bool" else f"i[{at}]"

    def _made(self, kind: type, parts: list[str]) -> str:
        return f"{self._named(kind)}({', '.join(parts)})"

    def _tuple(self, count: int) -> str:
        return f"({''.join(f'i[{self._word()}], ' for _ in range(count))})"

    def result(self, tree: Tree, value: str) -> None:
        """Add the statements that leave a result in the words."""
        if isinstance(tree, TupleType):
            for k, part in enumerate(tree.parts):
                self.result(part, f"{value}[{k}]")
        elif isinstance(tree, ArrayType):
            at, name, dtype = self._word(), f"r{self.words}", self._named(tree.dtype)
            self.lines += [
                f"{name} = {value}",
                f"{name}p = malloc({name}.size * {tree.dtype.itemsize} + 1)",
                f"carray({name}p, {name}.shape, {dtype})[...] = {name}",
                f"i[{at}] = address({name}p)",
                *(f"i[{self._word()}] = {name}.shape[{k}]" for k in range(tree.ndim)),
            ]
        elif tree == "complex128":
            self.lines += [f"f[{self._word()}] = {value}.real", f"f[{self._word()}] = {value}.imag"]
        elif tree != "none":
            self.lines.append(f"{'f' if tree == 'float64' else 'i'}[{self._word()}] = {value}")


def _entry(kernel: KernelFunction, arguments: Sequence[Tree], result: Tree) -> Callable[[Any], None]:
    """The function that becomes the code."""
    source = _Source()
    given = ", ".join(map(source.argument, arguments))
    source.result(result, "result")
    words = max(sum(map(width, arguments)) + width(result), 1)
    lines = [
        "def entry(block):",
        f"i = carray(block, ({words},), np.int64)",
        f"f = carray(block, ({words},), np.float64)",
        f"result = kernel({given})",
        *source.lines,
    ]
    source.names["kernel"] = kernel
    exec("\n    ".join(lines), source.names)
    entry: Callable[[Any], None] = source.names["entry"]
    return entry


def _emitted(entry: Any, name: str, native: str) -> bytes:
    """The machine code of an entry function, called `name` in it, with the text of its native call, if there is one.

    Numba's functions return a code, 0 and −2 if all is well, and store where their exception is described.
    """
    module = _linked(entry.library)
    module.link_in(llvm.parse_assembly(RUNTIME + CALL.format(name=name, inner=entry.fndesc.llvm_func_name)))
    if native:
        module.link_in(llvm.parse_assembly(f'declare ptr @"{name}"(ptr)\n{native}'))
    for function in module.functions:
        if not function.is_declaration and function.name not in (name, native_name(name)):
            function.linkage = "internal"
    for variable in module.global_variables:
        if not variable.is_declaration:
            variable.linkage = "internal"
    optimise(module)
    for function in module.functions:
        if function.is_declaration and not (function.name.startswith("llvm.") or hasattr(_process, function.name)):
            raise UnsupportedArgumentError(f"{name} needs {function.name} of Numba")
    code: bytes = target_machine().emit_object(module)
    return code


def _linked(part: _Part) -> Any:
    """The code of a function and of all that it calls, in one module."""
    module, to_link = llvm.parse_assembly(""), [part]
    parts = {part}
    others: dict[Any, None] = {}
    while to_link:
        linked = to_link.pop()
        module.link_in(linked.module, preserve=True)
        for callee in linked.callees:
            if not isinstance(callee, _Part):
                others[callee] = None
            elif callee not in parts:
                parts.add(callee)
                to_link.append(callee)
    for library in others:  # last, because only what is called by then is taken of their code
        module.link_in(_of_numba(library), preserve=True)
    return module


@cache
def _of_numba(library: Any) -> Any:
    """The code of a library that Numba has linked; several may hold the same function."""
    module = llvm.parse_assembly(library.get_llvm_str())
    for function in module.functions:
        if not function.is_declaration and function.linkage == llvm.Linkage.external:
            function.linkage = "linkonce_odr"
    return module
