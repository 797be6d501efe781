"""Hash of a source file and of everything that it imports of its own package and of ours.

A compiled kernel depends on the kernels and constants that its module takes from others. The files that an edit can
reach it from are those that its module imports, those that they import, and so on.
"""

import hashlib
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

_IMPORT = re.compile(
    rb"^[ \t]*(?:from[ \t]+(?P<dots>\.*)(?P<origin>[\w.]*)[ \t]+import[ \t]+(?P<names>\([^)]*\)|[^\n]*)"
    rb"|import[ \t]+(?P<modules>[^\n]*))",
    re.MULTILINE,
)
_NAME = re.compile(rb"[\w.]+")
_COMMENT = re.compile(rb"#[^\n]*")
_PACKAGE = Path(__file__).absolute().parents[1]
_OURS = (_PACKAGE, _PACKAGE.parents[1])
"""Folders of our package's modules: its own and, for some in a checkout, the top of that."""


@cache
def closure_digest(file: Path) -> str:
    """Digest of the texts and relative places of a file and of all that it imports, directly or not.

    Args:
        file: Absolute path of a module or script. Imports are followed into its own topmost package, or a script's
            folder, and into this package; those of other distributions are not.
    """
    root = _root(file)
    found = {file}
    open_ends = [file]
    while open_ends:
        new = _imported(open_ends.pop(), root) - found
        found |= new
        open_ends += new
    parts = sorted(_digest(path, root) for path in found)
    return hashlib.blake2b(b"".join(parts), digest_size=8).hexdigest()


def _root(file: Path) -> Path:
    """The folder that is searched for a file's absolute imports: the one above its topmost package."""
    folder = file.parent
    while (folder / "__init__.py").exists():
        folder = folder.parent
    return folder


@cache
def _digest(path: Path, root: Path) -> bytes:
    """Digest of one file's text and of its place below the root, wherever that is."""
    base = next(base for base in (_PACKAGE, root, _OURS[1]) if path.is_relative_to(base))
    return hashlib.blake2b(path.relative_to(base).as_posix().encode() + b"\0" + _text(path), digest_size=16).digest()


@cache
def _text(path: Path) -> bytes:
    return path.read_bytes()


@cache
def _imported(file: Path, root: Path) -> set[Path]:
    return {path for place in _named(file, root) for path in _files(place)}


def _named(file: Path, root: Path) -> Iterator[Path]:
    """Possible places of a file's imports, without suffix: of `from a import b` both a and a.b."""
    packages = (file.relative_to(root) if file.is_relative_to(root) else Path(_PACKAGE.name, file.name)).parts[:-1]
    own = packages[0] if packages else ""  # a script's folder is followed whole
    for match in _IMPORT.finditer(_text(file)):
        if match["modules"] is not None:
            for listed in _COMMENT.sub(b"", match["modules"]).split(b","):
                if name := _NAME.search(listed):
                    yield from _below(root, name[0], own)
            continue
        dots = len(match["dots"])
        for origin in _below(file.parents[dots - 1], match["origin"]) if dots else _below(root, match["origin"], own):
            yield origin
            for listed in _COMMENT.sub(b"", match["names"]).strip(b"()").split(b","):
                if name := _NAME.search(listed):
                    yield origin / name[0].decode()


def _below(base: Path, name: bytes, own: str = "") -> Iterator[Path]:
    """Candidate places of a module, without suffix.

    Args:
        base: The folder of its topmost package, unless that is ours.
        name: Of the module.
        own: The only package that is followed there; "" for all.
    """
    first, *rest = name.decode().split(".")
    if first == _PACKAGE.name:
        yield from (ours.joinpath(*rest) for ours in _OURS)
    elif own in ("", first):
        yield base.joinpath(first, *rest)


@cache
def _files(place: Path) -> tuple[Path, ...]:
    """The module at a place, if there is one there."""
    beside = place.with_name(place.name + ".py") if place.name else place
    candidates = (beside, place / "__init__.py")
    return tuple(path for path in candidates if path.is_file())
