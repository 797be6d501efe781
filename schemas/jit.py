"""How every numerical kernel is compiled.

Kernels are cached on disk, so only the first start after an installation or a change compiles. ``fastmath`` stays off:
the same scenario must give the same bits on every run.

Numba notices a change of a kernel's own file, but not of a kernel or a constant that it takes from another file. So the
cache's folder is named after the text of all files beside kernels: whatever changes, nothing stale is ever run.
"""

import hashlib
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numba
from numba.core import types

_ROOT = Path(__file__).resolve().parent.parent
_PACKAGES = ("schemas", "services")


def _fingerprint() -> str:
    """A hash of every source file in the folders that hold kernels."""
    digest = hashlib.blake2b(digest_size=8)
    paths = [path for package in _PACKAGES for path in sorted((_ROOT / package).rglob("*.py"))]
    texts = {path: path.read_bytes() for path in paths}
    folders = {path.parent for path, text in texts.items() if b"schemas.jit" in text}
    for path, text in texts.items():
        if path.parent in folders:
            digest.update(text)
    return digest.hexdigest()


def _cache_folder() -> Path:
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "touchline" / "kernels"


_settings: Any = numba.config
_settings.CACHE_DIR = str(Path(_settings.CACHE_DIR or _cache_folder()) / _fingerprint())


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function for the types that it is called with.

    Numba would compile one kernel anew for every constant that another one gives it, as a type of its own, though none
    here makes use of that: a quarter of all compilations at the robot's first start.
    """
    compiled: Any = numba.njit(cache=True, error_model="numpy")(function)
    by_types = compiled.get_call_template
    compiled.get_call_template = lambda args, kws: by_types(tuple(map(types.unliteral, args)), kws)
    _save_if_possible(compiled._cache)
    return compiled


def _save_if_possible(cache: Any) -> None:
    """A full disk costs the next start its time, not this one its kernel."""
    save = cache.save_overload

    def save_overload(*what: Any) -> None:
        with suppress(OSError):
            save(*what)

    cache.save_overload = save_overload
