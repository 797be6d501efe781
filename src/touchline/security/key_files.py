"""Files of keys: their folder, who may read them, and replacing several of them together."""

import fcntl
import os
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from touchline.schemas.errors import SpecError

_LOCK: Final = ".lock"


def make_private_folder(path: Path) -> None:
    """Make a folder that nobody else may look into, unless it is there.

    Raises:
        SpecError: It cannot be made, or is open to others.
    """
    try:
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        raise _unwritable(error, path) from error
    check_private(path)


def check_private(path: Path) -> None:
    """Refuse a file or folder that is not this user's, or that others may read or write.

    Raises:
        SpecError: It is not there, another user's, or open to others.
    """
    try:
        found = path.stat()
    except OSError as error:
        raise _unreadable(error, path) from error
    owned, private = ("chown -R", "chmod -R go=") if stat.S_ISDIR(found.st_mode) else ("chown", "chmod 600")
    if found.st_uid != os.geteuid():
        problem = f"belongs to the user with id {found.st_uid}, not to the one who uses it"
        raise SpecError(str(path), "", problem, f"{owned} {os.geteuid()} {path}")
    if found.st_mode & 0o077:
        problem = f"is open to others (mode {stat.S_IMODE(found.st_mode):o})"
        raise SpecError(str(path), "", problem, f"{private} {path}")


def read_file(path: Path) -> bytes:
    """Return the bytes of a file.

    Raises:
        SpecError: It cannot be read.
    """
    try:
        return path.read_bytes()
    except OSError as error:
        raise _unreadable(error, path) from error


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep others from changing the keys in a folder; wait for those who are at it.

    Raises:
        SpecError: The folder is not there, open to others, or cannot be written.
    """
    check_private(folder)
    try:
        lock = os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
    except OSError as error:
        raise _unwritable(error, folder / _LOCK) from error
    try:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield
    finally:
        os.close(lock)


def replace_files(contents: Mapping[Path, bytes]) -> None:
    """Write files with mode 600, in this order; each appears whole, and none if there is no room for all.

    Args:
        contents: Bytes by path; the folders must be there.

    Raises:
        SpecError: They cannot be written; all are as they were.
    """
    parts = {path: path.with_name(f".{path.name}.new") for path in contents}
    try:
        for path, part in parts.items():
            file = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
            with os.fdopen(file, "wb") as written:
                written.write(contents[path])
                written.flush()
                os.fsync(file)
        for path, part in parts.items():
            part.replace(path)
        for folder in {path.parent for path in contents}:
            _sync(folder)
    except OSError as error:
        raise _unwritable(error, Path(error.filename or next(iter(contents)))) from error
    finally:
        for part in parts.values():
            part.unlink(missing_ok=True)


def _sync(folder: Path) -> None:
    """Put the names of a folder's files on the disk, so that they outlast a power cut."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _unreadable(error: OSError, path: Path) -> SpecError:
    return SpecError(str(path), "", f"cannot be read ({error.strerror})", "give a folder of keys (touchline keys)")


def _unwritable(error: OSError, path: Path) -> SpecError:
    return SpecError(str(path), "", f"cannot be written ({error.strerror})", "make room, or give a writable folder")
