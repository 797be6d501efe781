"""Hash of a source file and of everything that it imports of its own package and of ours.

A compiled kernel depends on the kernels and constants that its module takes from others. The files that an edit can
reach it from are those that its module imports, those that they import, and so on.
"""

import hashlib
import os
import re
from collections.abc import Iterator
from functools import cache

_IMPORT = re.compile(
    rb"^[ \t]*(?:from[ \t]+(?P<dots>\.*)(?P<origin>[\w.]*)[ \t]+import[ \t]+(?P<names>\([^)]*\)|[^\n]*)"
    rb"|import[ \t]+(?P<modules>[^\n]*))",
    re.MULTILINE,
)
_NAME = re.compile(rb"[\w.]+")
_COMMENT = re.compile(rb"#[^\n]*")
_PACKAGE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
_TOP = os.path.dirname(os.path.dirname(_PACKAGE))
_OURS = (_PACKAGE, _TOP)
"""Folders of our package's modules: its own and, for some in a checkout, the top of that."""

# Places are text: every process that calls a kernel looks thousands of them up, and objects of them take five times as
# long.


@cache
def closure_digest(file: str) -> str:
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


def _root(file: str) -> str:
    """The folder that is searched for a file's absolute imports: the one above its topmost package."""
    folder = os.path.dirname(file)
    while os.path.exists(f"{folder}/__init__.py"):
        folder = os.path.dirname(folder)
    return folder


def _relative(path: str, base: str) -> str:
    """The place of a file below a folder, "" if it is not below it."""
    return path[len(base) + 1 :] if path.startswith(f"{base}/") else ""


@cache
def _digest(path: str, root: str) -> bytes:
    """Digest of one file's text and of its place below the root, wherever that is."""
    place = _relative(path, _PACKAGE) or _relative(path, root) or _relative(path, _TOP)
    return hashlib.blake2b(place.encode() + b"\0" + _text(path), digest_size=16).digest()


@cache
def _text(path: str) -> bytes:
    with open(path, "rb") as file:
        return file.read()


@cache
def _imported(file: str, root: str) -> set[str]:
    return {path for place in _named(file, root) for path in _files(place)}


def _named(file: str, root: str) -> Iterator[str]:
    """Possible places of a file's imports, without suffix: of `from a import b` both a and a.b."""
    folders = os.path.dirname(_relative(file, root) or f"{os.path.basename(_PACKAGE)}/{os.path.basename(file)}")
    own = folders.split("/")[0]  # a script's folder is followed whole
    for match in _IMPORT.finditer(_text(file)):
        if match["modules"] is not None:
            for listed in _COMMENT.sub(b"", match["modules"]).split(b","):
                if name := _NAME.search(listed):
                    yield from _below(root, name[0], own)
            continue
        base = file
        for _ in match["dots"]:
            base = os.path.dirname(base)
        for origin in _below(base, match["origin"]) if base != file else _below(root, match["origin"], own):
            yield origin
            for listed in _COMMENT.sub(b"", match["names"]).strip(b"()").split(b","):
                if name := _NAME.search(listed):
                    yield f"{origin}/{name[0].decode()}"


def _below(base: str, name: bytes, own: str = "") -> Iterator[str]:
    """Candidate places of a module, without suffix.

    Args:
        base: The folder of its topmost package, unless that is ours.
        name: Of the module; empty for the package in `base`.
        own: The only package that is followed there; "" for all.
    """
    first, *rest = name.decode().split(".")
    if first == os.path.basename(_PACKAGE):
        yield from ("/".join((ours, *rest)) for ours in _OURS)
    elif own in ("", first):
        yield "/".join((base, first, *rest)) if first else base


@cache
def _files(place: str) -> tuple[str, ...]:
    """The module at a place, if there is one there."""
    return tuple(path for path in (f"{place}.py", f"{place}/__init__.py") if os.path.isfile(path))
