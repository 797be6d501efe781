"""Transition methods and their choice by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from touchline.schemas.messages import PlanOptions
from touchline.schemas.plugins import METHODS
from touchline.services.planner.chosen_plugin import chosen
from touchline.services.planner.plugin_answers import blaming

if TYPE_CHECKING:
    from touchline.services.planner.limits import Limits
    from touchline.services.planner.transitions.transitions import TransitionFamily


@dataclass(frozen=True)
class Method:
    """A transition method, registered in `METHODS`.

    Attributes:
        transitions: Makes the method's transitions within given limits.
        by_dynamics: Whether it turns as tightly as the wheels' dynamics allow, where the options do not say; else as
            the vehicle's data say.
        joins: Whether segments that go on into each other are painted in one go.
    """

    transitions: Callable[[Limits], TransitionFamily]
    by_dynamics: bool = False
    joins: bool = True


def method_of(options: PlanOptions) -> Method:
    """The method that the options name; "" is the default one.

    Raises:
        PlanningError: There is no such method, or another package's is none.
    """
    found: Method = chosen(METHODS, options.method, "method")
    blame = blaming(METHODS, options.method)
    if blame is not None and not isinstance(found, Method):
        raise blame(f"it is {found!r}, not a Method")
    return found
