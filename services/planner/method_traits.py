"""Traits of a transition method that earlier stages need."""

from dataclasses import dataclass
from typing import TypeVar

from touchline.schemas.messages import PlanOptions
from touchline.schemas.plugins import METHODS
from touchline.services.planner.chosen_plugin import chosen
from touchline.services.planner.plugin_answers import blaming

T = TypeVar("T", bound="MethodTraits")


@dataclass(frozen=True, kw_only=True)
class MethodTraits:
    """Traits of a transition method.

    Attributes:
        by_dynamics: Whether its turns are by default as tight as the wheels' dynamics allow, not as the vehicle's data.
        joins: Whether segments that continue each other are painted without a break.
    """

    by_dynamics: bool = False
    joins: bool = True


def method_as(kind: type[T], options: PlanOptions) -> T:
    """Look up the method that the options name, or its traits; "" is the default one.

    Raises:
        PlanningError: There is no such method, or a plug-in's is no method.
    """
    found: T = chosen(METHODS, options.method, "method")
    blame = blaming(METHODS, options.method)
    if blame is not None and not isinstance(found, kind):
        raise blame(f"it is {found!r}, not a Method")
    return found
