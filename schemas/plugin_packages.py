"""Packages of others that offer plug-ins: which are installed, and which one an exception comes from."""

import traceback
from collections.abc import Iterator
from importlib.metadata import Distribution, EntryPoint, entry_points
from typing import Final

from touchline.schemas.errors import TouchlineError

_PREFIX: Final = "touchline."


class PluginError(TouchlineError):
    """Code of another package failed while it was used."""


def installed() -> dict[str, str]:
    """Version by name of every installed package that offers a plug-in."""
    return dict(sorted((dist.name, dist.version) for _, dist in _offers()))


def blamed(error: Exception) -> PluginError | None:
    """The error as one that names the package whose code it went through; None if it went through none of a plug-in."""
    offered = {point.module.partition(".")[0]: f"{dist.name} {dist.version}" for point, dist in _offers()}
    if not offered:
        return None
    for frame, _ in traceback.walk_tb(error.__traceback__):
        package = offered.get(str(frame.f_globals.get("__name__", "")).partition(".")[0])
        if package is not None:
            shown = f"the package {package} fails with {type(error).__name__}: {error}"
            return PluginError(f"{shown}; mend or uninstall the package, or use another plug-in")
    return None


def _offers() -> Iterator[tuple[EntryPoint, Distribution]]:
    """Entry points of plug-ins, each with the distribution that it is from."""
    for group in entry_points().groups:
        if group.startswith(_PREFIX):
            for point in entry_points(group=group):
                if point.dist is not None:
                    yield point, point.dist
