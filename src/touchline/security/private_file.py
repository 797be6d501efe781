"""Opening of files that only this user may read."""

import os
import stat
from pathlib import Path


def open_private(path: Path, flags: int) -> int:
    """Open or create a private file; symbolic and hard links are refused, and it waits for nobody.

    Args:
        path: The file.
        flags: Flags of `os.open` beside those for that.

    Raises:
        OSError: It cannot be opened, or is not a plain file of this user's alone.
    """
    file = os.open(path, flags | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC | os.O_NONBLOCK, 0o600)
    found = os.fstat(file)
    if not stat.S_ISREG(found.st_mode) or found.st_uid != os.geteuid() or found.st_nlink != 1:
        os.close(file)
        raise OSError(f"{path} is not a plain file of this user's alone")
    os.fchmod(file, 0o600)
    return file
