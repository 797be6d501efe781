"""Writing files that a person asked for; what the system has against one is told as can be mended."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from schemas.errors import SpecError


@contextmanager
def writing(path: Path, kind: str = "path") -> Iterator[None]:
    """What is done here writes ``path``, or files in it.

    Args:
        path: Where to.
        kind: What the remedy calls it.

    Raises:
        SpecError: It cannot be written.
    """
    try:
        yield
    except OSError as error:
        problem = f"cannot be written ({error.strerror})"
        raise SpecError(str(error.filename or path), "", problem, f"give a writable {kind}") from error


def write_text(text: str, path: Path) -> None:
    """Write ``text`` to ``path``.

    Raises:
        SpecError: It cannot be written.
    """
    with writing(path):
        path.write_text(text, encoding="utf-8")


def write_json(figures: dict[str, Any], path: Path) -> None:
    """Write ``figures`` to ``path``.

    Raises:
        SpecError: It cannot be written.
    """
    write_text(json.dumps(figures, indent=2, allow_nan=False) + "\n", path)
