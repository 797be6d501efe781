"""How every numerical kernel is compiled.

Kernels are cached on disk, so only the first start after an installation or a change compiles. ``fastmath`` stays off:
the same scenario must give the same bits on every run.

Numba notices a change of a kernel's own file, but not of a kernel or a constant that it takes from another file. So a
kernel's cache is found by the text of its module and of all that this imports: nothing stale is ever run, and an edit
compiles again only what depends on it.
"""

import fcntl
import gc
import inspect
import os
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numba.core import types
from numba.core.caching import CompileResultCacheImpl, FunctionCache, NullCache, UserProvidedCacheLocator
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Flags, compile_extra
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import CPUDispatcher
from numba.core.runtime.nrt import rtsys
from numba.core.typing.templates import make_concrete_template

from touchline.core.import_closure import closure_digest

_PACKAGE = __name__.partition(".")[0]
#: Compiled code that nobody has used for so long is removed.
_UNUSED_S = 30 * 24 * 3600.0
_DAY_S = 24 * 3600.0


def _cache_folder() -> Path:
    """The folder for all compiled code, `$XDG_CACHE_HOME/touchline/kernels`."""
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "touchline" / "kernels"


# So many new objects between two collections: compiling makes a great many, hardly any of which are garbage then.
_OBJECTS = 100_000


class _Place(UserProvidedCacheLocator):
    """The folder of one module's compiled code, named after the module and the text of all that it imports."""

    def __init__(self, function: Any, file: str) -> None:
        self._py_file, self._lineno = file, function.__code__.co_firstlineno
        module = Path(file).absolute()
        self._cache_path = str(_cache_folder() / f"{module.stem}-{closure_digest(module)}")

    def get_source_stamp(self) -> str:
        """A constant: the folder's name says what it was compiled from."""
        return ""

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> "_Place":
        """The place for a function of that file."""
        return cls(py_func, py_file)


class _Results(CompileResultCacheImpl):
    _locator_classes = [_Place]  # noqa: RUF012 - as Numba declares it


class _Files(FunctionCache):
    """Compiled code of one kernel on disk."""

    _impl_class = _Results

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """As Numba's, which also loads all that compiling takes: a third of a process's start, mostly for nothing."""
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)  # type: ignore[no-untyped-call]

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        """As Numba's, and what the classes of the arguments import: their kernels are compiled into this one."""
        key = super()._index_key(sig, codegen)  # type: ignore[no-untyped-call]
        return (*key, tuple(sorted({closure_digest(file) for kind in sig for file in _class_files(kind)})))


class _Cache(NullCache):
    """Compiled code on disk. If it cannot be written, because the disk is full, the next start compiles it again.

    Processes write one after another: the code of two signatures of a kernel gets one name, and one is then run for the
    other, if each is written by a process that has not seen the other's in the kernel's index.

    Code for a named tuple of somebody else is made anew in every process: the index could be read only where that
    class can be imported, and would not notice a change of its kernels.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function

    @cached_property
    def files(self) -> _Files:
        """The files, which are looked for when the kernel is first called with types that are new."""
        files = _Files(self._function)  # type: ignore[no-untyped-call]
        _mark_used(Path(files.cache_path))
        return files

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The code for a signature, or None if there is none yet."""
        return self.files.load_overload(sig, target_context)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep the code for a signature."""
        if any(map(_foreign, sig)):
            return
        folder = Path(self.files.cache_path)
        with suppress(OSError), _one_at_a_time(folder):
            self.files.save_overload(sig, data)  # type: ignore[no-untyped-call]
        _remove_unused(folder.parent)


def _mark_used(folder: Path) -> None:
    """Write down, once a day, that compiled code is in use."""
    with suppress(OSError):
        if time.time() - folder.stat().st_mtime > _DAY_S:
            os.utime(folder)


def _remove_unused(base: Path) -> None:
    """Remove the compiled code that no process has used for a month."""
    oldest = time.time() - _UNUSED_S
    with suppress(OSError):
        for folder in base.iterdir():
            if folder.stat().st_mtime < oldest:
                shutil.rmtree(folder, ignore_errors=True)


def _class_files(kind: Any) -> Iterator[Path]:
    """The source files of the classes of the named tuples in a type."""
    if isinstance(kind, types.BaseNamedTuple):
        named: Any = kind
        yield Path(inspect.getfile(named.instance_class)).absolute()
    if isinstance(kind, types.BaseTuple):
        parts: Any = kind
        for part in parts:
            yield from _class_files(part)


def _foreign(kind: Any) -> bool:
    """Whether a type is, or holds, a named tuple of a class that is not ours."""
    if not isinstance(kind, types.BaseTuple):
        return False
    held: Any = kind
    named = isinstance(kind, types.BaseNamedTuple)
    return (named and held.instance_class.__module__.partition(".")[0] != _PACKAGE) or any(map(_foreign, held))


@contextmanager
def _one_at_a_time(folder: Path) -> Iterator[None]:
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "writing").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


class _Part(JITCodeLibrary):
    """Code that is only linked into its callers', which become machine code; optimised first, it makes them faster."""

    def _finalize_final_module(self) -> None:
        self._finalized = True


class Kernel(CPUDispatcher):
    """A compiled function, which Python and other kernels call.

    For Python it is optimised, made into machine code, wrapped and cached. Most kernels are called by other kernels
    only, whose code then holds theirs. Numba would do all of that for each of them nevertheless, and once more for
    every constant that it is called with, as a type of its own: half of the robot's first start.

    Attributes:
        preparing_s: Time that this process has spent on compiling or loading kernels.
    """

    preparing_s = 0.0

    def __init__(self, function: Callable[..., Any], *, counting: bool = True, locked: bool = True) -> None:
        """Nothing is compiled before the first call.

        Args:
            function: In the part of Python that Numba compiles.
            counting: Whether references to arrays are counted, or arrays only borrowed.
            locked: Whether other threads of Python wait while it runs.
        """
        options = {"nopython": True, "nogil": not locked, "error_model": "numpy", "_nrt": counting}
        super().__init__(function, targetoptions=options)
        self._cache: Any = _Cache(function)
        self._parts: dict[tuple[Any, ...], Any] = {}
        self._codes: dict[Any, Callable[..., Any]] = {}

    def compile(self, sig: Any) -> Any:
        """Compile or load the code for new types, when Python calls; Python collects less garbage meanwhile."""
        with global_compiler_lock:
            often = gc.get_threshold()
            gc.set_threshold(_OBJECTS, *often[1:])
            begun_s = time.perf_counter()
            try:
                return super().compile(sig)
            finally:
                Kernel.preparing_s += time.perf_counter() - begun_s
                gc.set_threshold(*often)

    def for_types_of(self, arguments: tuple[Any, ...]) -> Callable[..., Any]:
        """The code for arguments of these types, to be called many times with the like.

        It does not look at types any more, which takes as long as a short kernel: give it nothing else, and
        arrays of the same layout in memory.
        """
        makeup = _makeup(arguments)
        if makeup not in self._codes:
            code: Callable[..., Any] = self.compile(tuple(self.typeof_pyval(argument) for argument in arguments))
            self._codes[makeup] = code
        return self._codes[makeup]

    def get_call_template(self, args: Any, kws: Any) -> tuple[Any, ...]:
        """What Numba asks for when it types a call in another kernel: the signature that fits."""
        parameters, folded = self.fold_argument_types(args, kws)
        general = tuple(map(types.unliteral, folded))
        if general not in self.overloads and general not in self._parts:
            self._parts[general] = self._compile_part(general)
        compiled = self.overloads.get(general) or self._parts[general]
        name = self.py_func.__name__
        return make_concrete_template(name, name, [compiled.signature]), parameters, general, {}

    def get_overload(self, sig: Any) -> Any:
        """The key under which Numba finds the code for that call; `sig` are the types of its arguments."""
        return super().get_overload(sig) if sig in self.overloads else self._parts[sig].library

    def _compile_part(self, args: tuple[Any, ...]) -> Any:
        context: Any = self.targetctx
        flags: Any = Flags()
        self.targetdescr.options.parse_as_flags(flags, self.targetoptions)
        flags.no_compile = flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
        library = _Part(context.codegen(), self.py_func.__qualname__)  # type: ignore[no-untyped-call]
        part = compile_extra(self.typingctx, context, self.py_func, args, None, flags, {}, library)
        context.insert_user_function(library, part.fndesc, [library])
        return part


def _makeup(value: Any) -> Any:
    """What Numba's type of an argument depends on: working that out takes as long as hundreds of ticks of a robot."""
    if isinstance(value, tuple):
        return type(value), *map(_makeup, value)
    if isinstance(value, np.ndarray):
        flags = value.flags
        return value.dtype, value.ndim, flags.c_contiguous, flags.f_contiguous, flags.aligned, flags.writeable
    return type(value)


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function at its first call with each combination of argument types."""
    return Kernel(function)


def borrowing(function: Callable[..., Any]) -> Any:
    """As `kernel`, for a function that makes no arrays and returns none, but only borrows what it is given.

    Any other counts a reference whenever it takes an array out of a record, which in short kernels takes longer than
    what they do.
    """
    return Kernel(function, counting=False)


def unlocked(function: Callable[..., Any]) -> Any:
    """As `kernel`, for a long function that changes only what belongs to its caller: other threads go on meanwhile."""
    return Kernel(function, locked=False)


class KernelOfClass(Kernel):
    """Dispatches to the kernel of its name in the class of its first argument, a named tuple.

    In a kernel the types of all arguments are known when it is compiled, so the one that is meant is chosen then, and
    nothing is left to decide when it runs.
    """

    def _meant(self, first: Any) -> Any:
        return getattr(first, self.py_func.__name__)

    def __call__(self, first: Any, *others: Any) -> Any:
        """Call the kernel that is meant from Python."""
        return self._meant(type(first))(first, *others)

    def get_call_template(self, args: Any, kws: Any) -> tuple[Any, ...]:
        """As for the kernel that is meant."""
        found: tuple[Any, ...] = self._meant(args[0].instance_class).get_call_template(args, kws)
        return found

    def get_overload(self, sig: Any) -> Any:
        """As for the kernel that is meant."""
        return self._meant(sig[0].instance_class).get_overload(sig)


def kernel_of_class(stub: Callable[..., Any]) -> Any:
    """Dispatch to the kernel with the name of `stub` in the class of the first argument; the stub itself never runs."""
    return KernelOfClass(stub)
