"""The interface of pose methods, and what they make: a path from one pose to another, on which the robot may stand."""

import math
from dataclasses import dataclass
from typing import Protocol

from touchline.services.planner.geometry.clothoid import Floats, PathPose, PiecePath
from touchline.services.planner.poses.traveller import Traveller


@dataclass(frozen=True)
class CurveProgress:
    """How a curve of one stretch runs over its own parameter s from 0 to 1, by which timing laws drive it.

    Attributes:
        at: (n,) places of s, from 0 to 1.
        station_m: (n,) arc length there.
        rate_m: (n,) its derivative by s there.
    """

    at: Floats
    station_m: Floats
    rate_m: Floats


@dataclass(frozen=True)
class PosePath:
    """A path from pose to pose, at rest at both ends.

    Attributes:
        path: Its pieces, turns on the spot among them.
        note: What was chosen where the question left it open, or was done instead; "" if there is nothing to say.
        progress: Of a curve with a parameter of its own; None: arc length serves as that.
    """

    path: PiecePath
    note: str = ""
    progress: CurveProgress | None = None


class PoseMethod(Protocol):
    """A way to get from one pose to another, registered in `POSE_METHODS`."""

    def between(self, start: PathPose, goal: PathPose, traveller: Traveller) -> PosePath:
        """The path from `start` to `goal`; a goal with heading NaN may be reached with any.

        Raises:
            PlanningError: This vehicle cannot drive there by the method; it says what to do.
        """


def heading_note(heading_rad: float, why: str) -> str:
    """What is said of a heading that a method has chosen."""
    return f"heading {math.remainder(heading_rad, math.tau):.3f} rad at the goal, {why}"
