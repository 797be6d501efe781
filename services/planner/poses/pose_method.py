"""Interface of pose methods, and their result: a path from pose to pose, possibly with standstills."""

import math
from dataclasses import dataclass
from typing import Protocol

from touchline.services.planner.geometry.clothoid import Floats, PathPose, PiecePath
from touchline.services.planner.poses.traveller import Traveller


@dataclass(frozen=True)
class CurveProgress:
    """Progress along a curve over its parameter s, from 0 to 1, to which speed laws apply.

    Attributes:
        at: (n,) values of s, from 0 to 1.
        station_m: (n,) arc length there.
        rate_m: (n,) derivative of the arc length by s.
    """

    at: Floats
    station_m: Floats
    rate_m: Floats


@dataclass(frozen=True)
class PosePath:
    """A path from pose to pose, at rest at both ends.

    Attributes:
        path: Pieces, turns on the spot included.
        note: Sentence about a choice that the request left open; "" if there is none.
        progress: Progress along a curve with a parameter of its own; None: the parameter is arc length.
    """

    path: PiecePath
    note: str = ""
    progress: CurveProgress | None = None


class PoseMethod(Protocol):
    """Method that plans paths from pose to pose, registered in `POSE_METHODS`."""

    def between(self, start: PathPose, goal: PathPose, traveller: Traveller) -> PosePath:
        """Plan the path from `start` to `goal`; a goal with heading NaN may be reached with any heading.

        Raises:
            PlanningError: The vehicle cannot drive there by the method.
        """


def heading_note(heading_rad: float, why: str) -> str:
    """Note about a heading that a method has chosen."""
    return f"heading {math.remainder(heading_rad, math.tau):.3f} rad at the goal, {why}"
