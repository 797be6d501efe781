"""Machine code of kernels in this process: loaded by LLVM alone, called through ctypes."""

import ctypes
import pickle
import threading
from collections.abc import Callable
from functools import cache
from typing import Any, Final

import llvmlite.binding as llvm

_BASELINE: Final = "x86-64-v3"
_V3: Final = ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")
_LOCK: Final = threading.Lock()
_linked: set[str] = set()


@cache
def target() -> str:
    """The kind of processor that code is for: not this very one, so that it can be taken elsewhere."""
    triple = llvm.get_process_triple()
    if triple.startswith("x86_64"):
        features = llvm.get_host_cpu_features()
        return f"{triple} {_BASELINE if all(features.get(name) for name in _V3) else 'x86-64'}"
    return f"{triple} generic"


def target_machine() -> Any:
    """Makes code for that."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    triple, _, cpu = target().rpartition(" ")
    return llvm.Target.from_triple(triple).create_target_machine(
        cpu=cpu, opt=3, reloc="default", codemodel="jitdefault", jit=True
    )


@cache
def _engine() -> Any:
    """Links object files into this process."""
    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), target_machine())


def load(code: bytes, name: str) -> None:
    """Link an object file of this name into the process."""
    with _LOCK:
        if name not in _linked:
            _engine().add_object_file(llvm.ObjectFileRef.from_data(code))
            _engine().finalize_object()
            _linked.add(name)


def address_of(name: str) -> int:
    """Return the address of a function in what was loaded; 0 if there is none of that name."""
    with _LOCK:
        return int(_engine().get_function_address(name))


def runner(name: str, *, locked: bool) -> Callable[[int], int | None]:
    """Return a function in what was loaded, which takes the address of a block.

    It returns None or the address for `failure`.

    Args:
        name: Name of it.
        locked: Whether other threads of Python wait while it runs.
    """
    kind = ctypes.PYFUNCTYPE if locked else ctypes.CFUNCTYPE
    function: Callable[[int], int | None] = kind(ctypes.c_void_p, ctypes.c_void_p)(address_of(name))
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
