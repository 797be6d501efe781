"""The run folder, and files that are protected from others and from links."""

import contextlib
import os
import stat
import tempfile
from pathlib import Path
from typing import Final

from touchline.schemas.errors import TouchlineError
from touchline.security import private_file

_PRIVATE: Final = 0o700


def run_folder() -> Path:
    """Return the folder of lock files: ``$XDG_RUNTIME_DIR/touchline``, or one per user under the temporary folder.

    Raises:
        TouchlineError: It cannot be made, or is not a folder of this user's alone.
    """
    base = os.environ.get("XDG_RUNTIME_DIR")
    folder = Path(base) / "touchline" if base else Path(tempfile.gettempdir()) / f"touchline-{os.getuid()}"
    remedy = "remove it, or set XDG_RUNTIME_DIR to a folder of your own"
    try:
        folder.parent.mkdir(mode=_PRIVATE, parents=True, exist_ok=True)
        with contextlib.suppress(FileExistsError):
            folder.mkdir(mode=_PRIVATE)
        found = folder.lstat()
    except OSError as error:
        raise TouchlineError(f"the run folder {folder} cannot be used: {error.strerror or error}; {remedy}") from error
    if not stat.S_ISDIR(found.st_mode):
        raise TouchlineError(f"the run folder {folder} is not a folder; {remedy}")
    if found.st_uid != os.getuid():
        raise TouchlineError(f"the run folder {folder} belongs to user {found.st_uid}; {remedy}")
    if found.st_mode & 0o077:
        mode = stat.S_IMODE(found.st_mode)
        raise TouchlineError(f"the run folder {folder} is open to others (mode {mode:o}); chmod 700 it, or {remedy}")
    return folder


def open_private(path: Path, flags: int) -> int:
    """Open or create a private file, unreadable to others; symbolic links are refused.

    Raises:
        TouchlineError: The path is a link, or not a plain file of this user's.
    """
    try:
        return private_file.open_private(path, flags)
    except OSError as error:
        problem = f"{path} cannot be used: {error.strerror}" if error.strerror else str(error)
        raise TouchlineError(f"{problem}; remove it") from error
