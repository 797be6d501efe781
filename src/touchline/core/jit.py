"""Kernels: numerical functions that are compiled, each for the types of arguments that it is called with.

Compiled code is kept on disk (`kernel_store`), so only the first start after an installation or a change compiles, if
no wheel brought it. Numba is imported only then. ``fastmath`` stays off: the same scenario must give the same bits on
every run.
"""

import ctypes
import inspect
import time
from collections.abc import Callable
from functools import update_wrapper
from itertools import count
from pathlib import Path
from threading import Lock
from types import MethodType
from typing import Any

from touchline.core import kernel_store
from touchline.core.compilations import compiling
from touchline.core.kernel_arguments import Tree, UnsupportedArgumentError, makeup, tree_of, writeable
from touchline.core.kernel_calls import MISS, Run, made_call
from touchline.core.kernel_code import load, runner
from touchline.core.kernel_function import ClassFunction, KernelFunction
from touchline.core.native_call import native_call, native_name

_unnamed = count()
_Code = tuple[Run, list[Tree], Tree, int]


class Preparing:
    """The time that this process has spent on compiling and loading kernels, in one thread or several at once."""

    def __init__(self) -> None:
        self._lock, self._open, self._begun_s, self._spent_s = Lock(), 0, 0.0, 0.0

    def __enter__(self) -> None:
        with self._lock:
            if not self._open:
                self._begun_s = time.perf_counter()
            self._open += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._open -= 1
            if not self._open:
                self._spent_s += time.perf_counter() - self._begun_s

    @property
    def spent_s(self) -> float:
        """So far."""
        with self._lock:
            return self._spent_s + (time.perf_counter() - self._begun_s if self._open else 0.0)


PREPARING = Preparing()


class Kernel(KernelFunction):
    """A compiled function, which Python and other kernels call.

    Attributes:
        prepared: A function to call for each makeup of arguments so far.
    """

    def __init__(self, function: Callable[..., Any], *, counting: bool = True, locked: bool = True) -> None:
        """Nothing is compiled before the first call."""
        super().__init__(function, counting=counting, locked=locked)
        update_wrapper(self, function)
        self.prepared: dict[Any, Callable[..., Any]] = {}
        self._recent: Callable[..., Any] = lambda *_: MISS
        self._trusting: dict[Any, Callable[..., Any]] = {}
        self._codes: dict[Any, _Code] = {}
        self._parameters = function.__code__.co_argcount

    def __get__(self, instance: Any, owner: type | None = None) -> Any:
        """The kernel as a method of its first argument."""
        return self if instance is None else MethodType(self, instance)

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Call the compiled function."""
        if named or len(arguments) != self._parameters:
            bound = inspect.signature(self.py_func).bind(*arguments, **named)
            bound.apply_defaults()
            arguments = bound.args
        value = self._recent(*arguments)
        if value is not MISS:
            return value
        for call in list(self.prepared.values()):
            value = call(*arguments)
            if value is not MISS:
                self._recent = call
                return value
        key = makeup(arguments)
        self._recent = self.prepared[key] = self._prepared(key, arguments)
        return self._recent(*arguments)

    def for_types_of(self, arguments: tuple[Any, ...]) -> Callable[..., Any]:
        """Return a function for arguments of these types, to be called many times with the like.

        It does not look at the types of numbers: give it nothing else, and arrays of the same layout in memory.
        """
        key = makeup(arguments)
        if key not in self._trusting:
            try:
                run, trees, result, native = self._code(key, arguments)
            except UnsupportedArgumentError:
                return self._by_numba()
            packed = made_call(run, trees, result)
            self._trusting[key] = native_call(native, trees, result, packed) if native else packed
        return self._trusting[key]

    def address(self, arguments: tuple[Any, ...]) -> int:
        """Return the address of the code for arguments of these types: a function of the address of their words.

        Raises:
            UnsupportedArgumentError: They do not fit into words.
        """
        run, _, _, _ = self._code(makeup(arguments), arguments)
        return ctypes.cast(run, ctypes.c_void_p).value or 0  # type: ignore[arg-type]

    def _prepared(self, key: Any, arguments: tuple[Any, ...]) -> Callable[..., Any]:
        """The function for arguments of this makeup, which looks at their types."""
        try:
            run, trees, result, native = self._code(key, arguments)
        except UnsupportedArgumentError:
            by_numba = self._by_numba()
            return lambda *given: by_numba(*given) if makeup(given) == key else MISS
        if native and writeable(key):
            return native_call(native, trees, result, lambda *_: MISS, key[1:])
        return made_call(run, trees, result, key[1:])

    def _code(self, key: Any, arguments: tuple[Any, ...]) -> _Code:
        """The code for arguments of this makeup, loaded or else compiled."""
        if key not in self._codes:
            with PREPARING:
                self._codes[key] = self._made(list(map(tree_of, arguments)))
        return self._codes[key]

    def _made(self, trees: list[Tree]) -> _Code:
        name = kernel_store.name_of(self.py_func, trees)
        if name is None:  # nobody could find it again
            name = f"{self.py_func.__name__}-{next(_unnamed)}"
            found: tuple[bytes | Path, Tree] = self._compiled(trees, name)
        else:
            found = kernel_store.find(name) or self._compiled_and_kept(trees, name)
        code, result = found
        address_of = load(code, name)
        return runner(address_of(name), locked=self.locked), trees, result, address_of(native_name(name))

    def _compiled_and_kept(self, trees: list[Tree], name: str) -> tuple[bytes | Path, Tree]:
        with kernel_store.compiling_alone(name):
            found = kernel_store.find(name)  # another process may have been at it
            if found is not None:
                return found
            made = self._compiled(trees, name)
            kernel_store.keep(name, *made)
        return made

    def _compiled(self, trees: list[Tree], name: str) -> tuple[bytes, Tree]:
        from touchline.core.compiler import compile_code  # here: it brings Numba, which takes as long as a start

        with compiling(self.py_func):
            return compile_code(self, trees, name)

    def _by_numba(self) -> Callable[..., Any]:
        """Numba's own function, which takes arguments of any type."""
        from touchline.core.compiler import dispatcher_of

        dispatcher: Callable[..., Any] = dispatcher_of(self)
        return dispatcher


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


class KernelOfClass(ClassFunction):
    """Dispatches to the kernel of its name in the class of its first argument, a named tuple.

    In a kernel the types of all arguments are known when it is compiled, so the one that is meant is chosen then, and
    nothing is left to decide when it runs.
    """

    def __call__(self, first: Any, *others: Any, **named: Any) -> Any:
        """Call the kernel that is meant from Python."""
        return self.meant(type(first))(first, *others, **named)


def kernel_of_class(stub: Callable[..., Any]) -> Any:
    """Dispatch to the kernel with the name of `stub` in the class of the first argument; the stub itself never runs."""
    return KernelOfClass(stub)
