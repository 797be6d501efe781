"""Transition methods and their choice by name."""

from collections.abc import Callable
from dataclasses import dataclass

from touchline.schemas.messages import PlanOptions
from touchline.services.planner.limits import Limits
from touchline.services.planner.method_traits import MethodTraits, method_as
from touchline.services.planner.transitions.transitions import TransitionFamily


@dataclass(frozen=True)
class Method(MethodTraits):
    """A transition method, registered in `METHODS`.

    Attributes:
        transitions: Creates the method's transitions within given limits.
    """

    transitions: Callable[[Limits], TransitionFamily]


def method_of(options: PlanOptions) -> Method:
    """Look up the method that the options name; "" is the default one.

    Raises:
        PlanningError: There is no such method, or a plug-in's is no method.
    """
    return method_as(Method, options)
