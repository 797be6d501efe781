"""Traits of a transition method that the stages before the transitions ask for."""

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
        by_dynamics: Whether it turns as tightly as the wheels' dynamics allow, where the options do not say; else as
            the vehicle's data say.
        joins: Whether segments that go on into each other are painted in one go.
    """

    by_dynamics: bool = False
    joins: bool = True


def method_as(kind: type[T], options: PlanOptions) -> T:
    """The method that the options name, or the traits of it; "" is the default one.

    Raises:
        PlanningError: There is no such method, or another package's is none.
    """
    found: T = chosen(METHODS, options.method, "method")
    blame = blaming(METHODS, options.method)
    if blame is not None and not isinstance(found, kind):
        raise blame(f"it is {found!r}, not a Method")
    return found
