"""Compiled kernels on disk: a library in the package, if a wheel brought it, and `$XDG_CACHE_HOME/touchline/kernels`.

A file there holds the code of one kernel for one set of argument types. Its name, as that of a kernel in the library,
has a digest of both, of the text of the kernel's module and all that this imports, of Numba's version and of the kinds
of processor and Python: nothing stale is ever run, and an edit compiles again only what depends on it.
"""

import fcntl
import hashlib
import inspect
import json
import logging
import os
import shutil
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final, TypedDict

import numpy as np

from touchline.core.import_closure import closure_digest
from touchline.core.kernel_arguments import ArrayType, RecordType, Tree, TupleType, classes_of
from touchline.core.kernel_code import library, target
from touchline.core.native_call import LAYOUT

#: Changes whenever files of the same name mean something else.
_FORMAT: Final = 2
#: The library of a wheel, and what is known of its kernels: `kernels.py` makes both.
LIBRARY: Final = "kernels.so"
CONTENTS: Final = "kernels.json"
_SHIPPED: Final = Path(__file__).with_name("compiled")
#: Code that nobody has used for so long is removed, and the oldest beyond so many bytes.
_UNUSED_S: Final = 30 * 24 * 3600.0
_MOST_BYTES: Final = 200_000_000
_DAY_S: Final = 24 * 3600.0
_LOG: Final = logging.getLogger(__name__)


def cache_folder() -> Path:
    """The folder of code that was compiled here."""
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "touchline" / "kernels"


class Contents(TypedDict):
    """Contents of a library of kernels: Numba's version, the digest of the library, and types of results by name."""

    numba: str
    digest: str
    results: dict[str, Any]


@cache
def shipped() -> Contents:
    """Contents of the package's library; nothing if it has none, or one that cannot be used, of which it warns."""
    if _SHIPPED.is_dir():
        try:
            contents: Contents = json.loads((_SHIPPED / CONTENTS).read_text(encoding="utf-8"))
            if contents["digest"] == digest((_SHIPPED / LIBRARY).read_bytes()):
                library(_SHIPPED / LIBRARY)
                return contents
            problem = f"{_SHIPPED / LIBRARY} is damaged"
        except (OSError, ValueError, KeyError, TypeError) as error:
            problem = str(error) if isinstance(error, OSError) else f"{_SHIPPED / CONTENTS} is damaged"
        _LOG.warning("the compiled kernels of the package cannot be used: %s; reinstall Touchline", problem)
    return {"numba": "", "digest": "", "results": {}}


@cache
def numba_version() -> str:
    """The version of Numba that compiles kernels, or compiled those of the library; empty without either."""
    try:
        return version("numba")
    except PackageNotFoundError:
        return shipped()["numba"]


def name_of(function: Any, arguments: Sequence[Tree]) -> str | None:
    """The name of a kernel's code for arguments of these types; None if code cannot be found again by a name.

    It cannot if the kernel or a class among the arguments is made by a function, or is of no file.
    """
    made_by = [function, *(kind for tree in arguments for kind in classes_of(tree))]
    files = [_file(each) for each in made_by]
    if function.__closure__ or not all(files):
        return None
    digests = sorted({closure_digest(file) for file in files if file})
    module = "" if function.__module__ == "__main__" else function.__module__
    what = [module, function.__qualname__, function.__code__.co_firstlineno, *map(str, arguments), *digests]
    text = repr((_FORMAT, LAYOUT, numba_version(), target(), what))
    return f"{function.__name__}-{hashlib.blake2b(text.encode(), digest_size=12).hexdigest()}"


@cache
def _file(made: Any) -> str | None:
    """The source file of a function or class at the top of a module or class."""
    if "<locals>" in made.__qualname__:
        return None
    with suppress(OSError, TypeError):
        file = Path(inspect.getfile(made)).absolute()
        return str(file) if file.exists() else None
    return None


def find(name: str) -> tuple[bytes | Path, Tree] | None:
    """The code of that name, as `load` takes it, and the type of its result, if there is any."""
    with suppress(KeyError, AttributeError, ImportError):
        return _SHIPPED / LIBRARY, _tree(shipped()["results"][name])
    file = cache_folder() / f"{name}.o"
    with suppress(OSError, ValueError, AttributeError, ImportError):
        listed, code = read(file)
        result = _tree(listed)
        _mark_used(file)
        return code, result
    return None


def read(file: Path) -> tuple[Any, bytes]:
    """Read the type of the result, as JSON has it, and the code from a file of the cache.

    Raises:
        OSError: It cannot be read.
        ValueError: It is damaged.
    """
    head, code = file.read_bytes().split(b"\n", 1)
    listed, found = json.loads(head)
    if found != digest(code):
        raise ValueError(file)
    return listed, code


def _mark_used(file: Path) -> None:
    """Note, once a day, that code is in use."""
    with suppress(OSError):
        if time.time() - file.stat().st_mtime > _DAY_S:
            os.utime(file)


def keep(name: str, code: bytes, result: Tree) -> None:
    """Write code to the cache, if that is possible; where the disk is full, the next process compiles it again."""
    folder = cache_folder()
    written = folder / f"{name}.{os.getpid()}"
    with suppress(OSError, TypeError):
        head = json.dumps([_listed(result), digest(code)]).encode()
        try:
            written.write_bytes(head + b"\n" + code)
            written.replace(folder / f"{name}.o")
        finally:
            written.unlink(missing_ok=True)
        _prune(folder)


@contextmanager
def compiling_alone(name: str) -> Iterator[None]:
    """Have other processes wait that want the same code."""
    lock = None
    with suppress(OSError):
        cache_folder().mkdir(parents=True, exist_ok=True)
        lock = (cache_folder() / f"{name}.lock").open("w")
        fcntl.flock(lock, fcntl.LOCK_EX)
    try:
        yield
    finally:
        if lock is not None:
            with suppress(OSError):
                Path(lock.name).unlink(missing_ok=True)
            lock.close()


def digest(code: bytes) -> str:
    """Digest that shows damage, by the hash that processors have instructions for."""
    return hashlib.sha256(code).hexdigest()


def _prune(folder: Path) -> None:
    """Remove what has not been used for a month, and the oldest of what is too much."""
    now, room = time.time(), _MOST_BYTES
    entries = [(entry.stat(), entry) for entry in folder.iterdir()]
    for stat, entry in sorted(entries, key=lambda each: each[0].st_mtime, reverse=True):
        room -= stat.st_size
        if now - stat.st_mtime > _UNUSED_S or room < 0:
            if entry.is_dir():
                shutil.rmtree(entry, ignore_errors=True)
            else:
                entry.unlink(missing_ok=True)


def _listed(tree: Tree) -> Any:
    """A type as JSON has it.

    Raises:
        TypeError: It cannot be found again.
    """
    if isinstance(tree, TupleType):
        if "<locals>" in tree.kind.__qualname__:
            raise TypeError(tree.kind)
        return ["tuple", tree.kind.__module__, tree.kind.__qualname__, *map(_listed, tree.parts)]
    if isinstance(tree, ArrayType):
        if tree.dtype.names:
            raise TypeError(tree.dtype)
        return ["array", tree.dtype.str, tree.ndim, tree.layout]
    if isinstance(tree, RecordType):
        raise TypeError(tree)
    return tree


def _tree(listed: Any) -> Tree:
    """A type from JSON."""
    if isinstance(listed, str):
        return listed
    kind, *rest = listed
    if kind == "array":
        dtype, ndim, layout = rest
        return ArrayType(np.dtype(dtype), ndim, layout)
    module, qualname, *parts = rest
    found: Any = import_module(module)
    for name in qualname.split("."):
        found = getattr(found, name)
    return TupleType(found, tuple(map(_tree, parts)))
