"""A section of the route: what is painted in one go, or the transition to it."""

from dataclasses import dataclass

from touchline.services.planner.geometry.clothoid import PiecePath
from touchline.services.planner.swaths.offset import Stroke

RUN_IN, TRANSITION, RUN_OUT = "run-in", "transition", "run-out"


@dataclass(frozen=True)
class Section:
    """A painted segment, a swath over an area, or the path between two of them.

    Attributes:
        label: For people.
        path: Driven.
        stroke: The painted segment.
        speed_mps: At which that is painted.
        swath_id: Of a swath over an area, one straight piece.
    """

    label: str
    path: PiecePath
    stroke: Stroke | None = None
    speed_mps: float = 0.0
    swath_id: str = ""

    @property
    def work_id(self) -> str:
        """Id of the painted segment or the swath; "" for a path between them."""
        return self.stroke.id if self.stroke else self.swath_id
