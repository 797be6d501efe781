"""The plug-in that the options of a plan name."""

from __future__ import annotations

from typing import TypeVar

from touchline.schemas.errors import PlanningError
from touchline.schemas.plugins import Registry, UnknownPlugin

T = TypeVar("T")


def chosen(registry: Registry[T], name: str, word: str) -> T:
    """The plug-in of that name; "" is the default one.

    Args:
        registry: That it is in.
        name: By which the options ask for it.
        word: What people call one of them.

    Raises:
        PlanningError: There is none of that name.
    """
    try:
        return registry.find(name or registry.default)
    except UnknownPlugin as error:
        known = ", ".join(registry.names())
        raise PlanningError("", f'asks for the unknown {word} "{name}"', f"use one of: {known}") from error
