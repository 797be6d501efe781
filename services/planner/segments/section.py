"""Section of a route: a painted segment, a swath or a transition."""

from dataclasses import dataclass

from touchline.services.planner.geometry.clothoid import PiecePath
from touchline.services.planner.swaths.offset import Stroke

RUN_IN, TRANSITION, RUN_OUT = "run-in", "transition", "run-out"


@dataclass(frozen=True)
class Section:
    """A painted segment, a swath over an area, or the transition between two of them.

    Attributes:
        label: Name for people.
        path: Driven path.
        stroke: Painted segment; None elsewhere.
        speed_mps: Speed of painting.
        swath_id: Id of a swath over an area, which is one straight piece; "" elsewhere.
    """

    label: str
    path: PiecePath
    stroke: Stroke | None = None
    speed_mps: float = 0.0
    swath_id: str = ""

    @property
    def work_id(self) -> str:
        """Id of the painted segment or the swath; "" for a transition."""
        return self.stroke.id if self.stroke else self.swath_id
