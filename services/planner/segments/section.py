"""A section of the route: what is painted in one go, or the transition to it."""

from dataclasses import dataclass

from touchline.services.planner.geometry.clothoid import PiecePath
from touchline.services.planner.swaths.offset import Stroke

RUN_IN, TRANSITION, RUN_OUT = "run-in", "transition", "run-out"


@dataclass(frozen=True)
class Section:
    """A painted segment and the speed at which it is painted, or the transition between two swaths."""

    label: str
    path: PiecePath
    stroke: Stroke | None = None
    speed_mps: float = 0.0
