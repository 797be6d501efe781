"""Machine code of kernels in this process, called through ctypes: of a library, or object files that LLVM links."""

import ctypes
import pickle
import platform
import sysconfig
import threading
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, Final

_BASELINE: Final = "x86-64-v3"
_V3: Final = {"avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe"}
"""As Linux calls them."""
_LOCK: Final = threading.Lock()
_linked: set[str] = set()

#: Makes code that can be linked into a library (`kernels.py`).
FOR_LIBRARY = False


@cache
def target() -> str:
    """The kind of processor and system that code is for: not this very one, so that it can be taken elsewhere."""
    system = f"{sysconfig.get_platform()} {platform.libc_ver()[0]}"
    if platform.machine() != "x86_64":
        return f"{system} generic"
    return f"{system} {_BASELINE if _features() >= _V3 else 'x86-64'}"


def _features() -> set[str]:
    """Names of the processor's instruction sets; none where the system is not Linux."""
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("flags"):
                return set(line.split())
    return set()


def target_machine() -> Any:
    """Makes code for that."""
    import llvmlite.binding as llvm  # here: all code may be in the library

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    reloc, model = ("pic", "small") if FOR_LIBRARY else ("default", "jitdefault")
    return llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(
        cpu=target().rpartition(" ")[2], opt=3, reloc=reloc, codemodel=model, jit=True
    )


@cache
def _engine() -> Any:
    """Links object files into this process."""
    import llvmlite.binding as llvm

    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), target_machine())


@cache
def library(path: Path) -> ctypes.CDLL:
    """Load a library of code.

    Raises:
        OSError: It cannot be loaded.
    """
    return ctypes.CDLL(str(path))


def _address_in(loaded: ctypes.CDLL, symbol: str) -> int:
    try:
        return ctypes.cast(loaded[symbol], ctypes.c_void_p).value or 0
    except AttributeError:
        return 0


def load(code: bytes | Path, name: str) -> Callable[[str], int]:
    """Link code into the process.

    Args:
        code: An object file, or the path of a library.
        name: Name of the object file.

    Returns:
        Function that gives the address of a function in it by name; 0 if there is none.
    """
    if isinstance(code, Path):
        loaded = library(code)
        return lambda symbol: _address_in(loaded, symbol)
    with _LOCK:
        if name not in _linked:
            import llvmlite.binding as llvm

            _engine().add_object_file(llvm.ObjectFileRef.from_data(code))
            _engine().finalize_object()
            _linked.add(name)
    return _address_of


def _address_of(symbol: str) -> int:
    with _LOCK:
        return int(_engine().get_function_address(symbol))


def runner(address: int, *, locked: bool) -> Callable[[int], int | None]:
    """Return a function of compiled code, which takes the address of a block.

    It returns None or the address for `failure`.

    Args:
        address: Address of it.
        locked: Whether other threads of Python wait while it runs.
    """
    kind = ctypes.PYFUNCTYPE if locked else ctypes.CFUNCTYPE
    function: Callable[[int], int | None] = kind(ctypes.c_void_p, ctypes.c_void_p)(address)
    return function


class _Description(ctypes.Structure):
    """An exception as Numba's code describes it: (class, arguments, place), pickled."""

    _fields_ = (("pickled", ctypes.c_void_p), ("length", ctypes.c_int32))


def failure(address: int) -> Exception:
    """The exception that is described at an address."""
    described = _Description.from_address(address)
    try:
        kind, arguments, _ = pickle.loads(ctypes.string_at(described.pickled, described.length))
        error: Exception = kind(*(arguments or ()))
    except Exception as problem:  # noqa: BLE001 - arguments that only exist when it is raised
        return RuntimeError(f"a kernel failed, and why is not readable: {problem}")
    return error
