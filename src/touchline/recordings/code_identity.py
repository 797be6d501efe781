"""Identity of the code that runs: its commit, and a digest of its files."""

import hashlib
import os
import subprocess
import tomllib
from functools import cache
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Final

_ROOMS: Final = ("touchline", "touchline.schemas", "touchline.services")
"""Packages on which a session depends; beside them there are only the console and the studies."""
_SUFFIXES: Final = (".py", ".msg", ".srv")
_GIT_TIMEOUT_S: Final = 5.0


@cache
def own_version() -> str:
    """Version of the package: in a checkout as its pyproject.toml says, since an installation keeps that of its day."""
    project = Path(import_module("touchline").__path__[0]).parents[1] / "pyproject.toml"
    if project.is_file():
        told = tomllib.loads(project.read_text(encoding="utf-8")).get("project", {})
        if told.get("name") == "touchline":
            return str(told["version"])
    return version("touchline")


@cache
def code_digest() -> str:
    """Digest of the package's sources: equal for equal code, however it was installed."""
    digest = hashlib.blake2b(digest_size=8)
    for room in _ROOMS:
        top = Path(import_module(room).__path__[0])
        files = sorted(path for path in top.rglob("*") if path.suffix in _SUFFIXES)
        for path in files:
            place = path.relative_to(top).as_posix()
            if not place.startswith(_beside(room)):
                digest.update(f"{room}/{place}\0".encode())
                digest.update(path.read_bytes())
    return digest.hexdigest()


def _beside(room: str) -> tuple[str, ...]:
    """Folders of other rooms, and what a build writes, which lie in the package when it is installed."""
    return ("schemas/", "services/", "tui/", "_build.py") if room == "touchline" else ("\0",)


@cache
def commit() -> str:
    """Commit of the checkout, ending in "-dirty" if files differ from it; empty if it is not known.

    Of an installation it is the commit that it was built from.
    """
    try:
        built: str = import_module("touchline._build").COMMIT
    except ModuleNotFoundError:
        return _commit_of(Path(import_module("touchline").__path__[0]))
    return built


def _commit_of(folder: Path) -> str:
    command = ["git", "-C", str(folder), "describe", "--always", "--dirty", "--exclude=*", "--abbrev=40"]
    try:
        asked = subprocess.run(
            command,
            capture_output=True,
            text=True,
            timeout=_GIT_TIMEOUT_S,
            env={**os.environ, "GIT_OPTIONAL_LOCKS": "0"},
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return asked.stdout.strip()
