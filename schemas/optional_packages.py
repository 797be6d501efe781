"""Packages that only some features need: the extras in pyproject.toml."""

import re
import sys
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, distribution, requires
from importlib.util import find_spec
from types import FrameType
from typing import Final

from touchline.schemas.errors import MissingExtra

#: Names of packages that are not those of their modules.
_PACKAGES: Final = {
    "PIL": "pillow",
    "foxglove": "foxglove-sdk",
    "llvmlite": "numba",
    "touchline_research": "touchline-research",
    "zenoh": "eclipse-zenoh",
}


class _MissingModules:
    """Last finder of imports: asked only for modules that nobody else has found.

    What Touchline itself imports raises `MissingExtra`; imports of others fail as they always do.
    """

    def find_spec(self, name: str, _path: Sequence[str] | None = None, _target: object = None) -> None:
        """Refuse a missing module of an extra."""
        if "." not in name and _importer().startswith("touchline"):
            packages = _missing_with(_PACKAGES.get(name, name))
            if packages:
                raise _error("this", packages)


def name_packages_of_missing_imports() -> None:
    """Let failing imports in Touchline say which packages to install."""
    sys.meta_path.append(_MissingModules())


def require(module: str, feature: str) -> None:
    """Refuse a feature whose package is missing, before any work is done.

    Args:
        module: Of the package.
        feature: Its user-facing name, such as `--parquet`.

    Raises:
        MissingExtra: The package is not installed.
    """
    if find_spec(module) is None:
        raise _error(feature, _missing_with(_PACKAGES.get(module, module)))


def _importer() -> str:
    """The module that imports at this moment; `importlib.util` if it only asks whether there is such a module."""
    frame: FrameType | None = sys._getframe(2)
    while frame is not None:
        name = str(frame.f_globals.get("__name__", ""))
        if name != "importlib" and not name.startswith("importlib._"):
            return name
        frame = frame.f_back
    return ""


def _missing_with(package: str) -> list[str]:
    """The missing packages of the first extra that has this one, as `pip install` takes them; none if no extra has."""
    extras: dict[str, dict[str, str]] = {}
    for line in requires("touchline") or ():
        specifier, _, marker = line.partition("; extra == ")
        extras.setdefault(marker, {})[re.split(r"[^\w.-]", specifier)[0]] = specifier
    held = next((extra for extra in extras.values() if package in extra), {})
    return [specifier for name, specifier in held.items() if name == package or not _installed(name)]


def _installed(package: str) -> bool:
    try:
        distribution(package)
    except PackageNotFoundError:
        return False
    return True


def _error(feature: str, packages: Sequence[str]) -> MissingExtra:
    quoted = " ".join(f"'{each}'" for each in packages)
    what = "packages that are" if len(packages) > 1 else "a package that is"
    return MissingExtra(f"{feature} needs {what} not installed: pip install {quoted}")
