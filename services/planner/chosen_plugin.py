"""Choice of a plug-in by the options of a plan."""

from __future__ import annotations

from typing import TypeVar

from touchline.schemas.errors import PlanningError
from touchline.schemas.plugins import Registry, UnknownPlugin

T = TypeVar("T")


def chosen(registry: Registry[T], name: str, word: str) -> T:
    """Look up a plug-in by name; "" is the default one.

    Args:
        registry: Registry of the plug-ins.
        name: Name in the options.
        word: Kind of the plug-in in messages, such as "area method".

    Raises:
        PlanningError: There is no plug-in of that name.
    """
    try:
        return registry.find(name or registry.default)
    except UnknownPlugin as error:
        known = ", ".join(registry.names())
        raise PlanningError("", f'asks for the unknown {word} "{name}"', f"use one of: {known}") from error
