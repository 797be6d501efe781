"""Writing of files that a user requested; errors of the system become errors with a remedy."""

import json
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from touchline.schemas.errors import SpecError

#: File name that stands for standard output.
STANDARD_OUTPUT: Final = Path("-")


@contextmanager
def writing(path: Path, kind: str = "path") -> Iterator[None]:
    """Turn errors of writing ``path``, or files in it, into `SpecError`.

    Args:
        path: File or folder.
        kind: Word for it in the remedy.

    Raises:
        SpecError: It cannot be written.
    """
    try:
        yield
    except OSError as error:
        problem = f"cannot be written ({error.strerror})"
        raise SpecError(str(error.filename or path), "", problem, f"give a writable {kind}") from error


def check_writable(*paths: Path | None) -> None:
    """Refuse files that cannot be written, before any work is done.

    Raises:
        SpecError: A path is a folder, is in none, or may not be written.
    """
    for path in paths:
        if path is None or path == STANDARD_OUTPUT:
            continue
        with writing(path):  # a name that is too long, say
            if path.is_dir():
                reason = "is a folder"
            elif not path.parent.is_dir():
                reason = "there is no such folder"
            elif not os.access(path if path.exists() else path.parent, os.W_OK):
                reason = "no permission, or a read-only disk"
            else:
                continue
        raise SpecError(str(path), "", f"cannot be written ({reason})", "give a writable path")


def check_recordable(path: Path | None) -> None:
    """Refuse a recording that cannot be written, before anything is started.

    A recording of the same name would be renamed, so it is the folder that must be writable.

    Raises:
        SpecError: Its name does not end in ``.mcap``, or it cannot be made.
    """
    if path is None:
        return
    if path.suffix != ".mcap":
        raise SpecError(str(path), "", "is no name of a recording", "give one that ends in .mcap")
    check_writable(path)
    if not os.access(path.parent, os.W_OK):
        problem = "cannot be written (no permission in its folder, or a read-only disk)"
        raise SpecError(str(path), "", problem, "give a writable path")
    if os.path.lexists(path) and not path.is_file():
        raise SpecError(str(path), "", "is there already and is no recording", "choose another name")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary file, which replaces ``path`` when it is complete; else that stays unchanged.

    `STANDARD_OUTPUT` is written when the file is complete.

    Raises:
        SpecError: It cannot be written.
    """
    with writing(path):
        if path == STANDARD_OUTPUT:
            with tempfile.TemporaryDirectory() as folder:
                yield Path(folder) / "output"
                sys.stdout.flush()
                with (Path(folder) / "output").open("rb") as whole:
                    shutil.copyfileobj(whole, sys.stdout.buffer)
                sys.stdout.buffer.flush()
            return
        if path.exists() and not path.is_file():  # a pipe, say
            yield path
            return
        place = path.resolve()
        part = place.with_name(f".{place.name}.part")
        try:
            yield part
            part.replace(place)
        finally:
            part.unlink(missing_ok=True)


def write_text(text: str, path: Path) -> None:
    """Write ``text`` to ``path``: all of it, or the file stays unchanged.

    Raises:
        SpecError: It cannot be written.
    """
    with replacing(path) as part:
        part.write_text(text, encoding="utf-8")


def write_json(figures: dict[str, Any], path: Path) -> None:
    """Write ``figures`` to ``path`` as JSON.

    Raises:
        SpecError: It cannot be written.
    """
    write_text(json.dumps(figures, indent=2, allow_nan=False) + "\n", path)
