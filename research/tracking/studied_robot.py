"""Studied robot, a TurtleBot3 Waffle Pi with the maker's limits only, and the goals that it is sent to."""

import math
from typing import Final, NamedTuple

import numpy as np

from touchline.core.jit import kernel
from touchline.schemas.messages import PlanOptions
from touchline.schemas.vehicles.shipped import TURTLEBOT3_WAFFLE_PI
from touchline.services.planner.drives.caps import Caps
from touchline.services.planner.geometry.clothoid import PathPose
from touchline.services.planner.poses.traveller import Traveller

ORIGIN: Final = PathPose(0.0, 0.0, 0.0)
WAFFLE: Final = Traveller.of(TURTLEBOT3_WAFFLE_PI, PlanOptions())
SPEED_MPS: Final = 0.26
YAW_RADPS: Final = 1.82
STUDY_TANGENT_M: Final = 10.0
"""Tangent lengths k_i = k_f of the study."""


class BodyCaps(NamedTuple):
    """Limits of the study: independent speed (m/s) and yaw rate (rad/s), and none of wheels or acceleration."""

    speed_mps: float
    yaw_radps: float

    @kernel
    def square_cap(self, curvature: float, _sharpness: float) -> float:
        """Maximum v² (m²/s²) at a curvature (1/m)."""
        square = self.speed_mps**2
        if curvature > 0.0:
            square = min(square, (self.yaw_radps / curvature) ** 2)
        return float(square)

    @kernel
    def spin_lever_m(self) -> float:
        """Radius (m) at which a turn on the spot at the maximum yaw rate has the maximum speed."""
        return float(self.speed_mps / self.yaw_radps)


STUDY_CAPS: Final = Caps(SPEED_MPS, math.inf, math.inf, BodyCaps(SPEED_MPS, YAW_RADPS))


def goals_anywhere(count: int) -> list[PathPose]:
    """Spread goals evenly over a box of 10 m around the robot and all headings.

    They are Halton's points ("On the efficiency of certain quasi-random sequences of points in evaluating
    multi-dimensional integrals", Numerische Mathematik 2, 1960) from the second on, the first being a corner. Medians
    of 600 random goals differ by 0.3 s from draw to draw, more than the methods differ.
    """
    from scipy.stats import qmc

    points = qmc.Halton(3, scramble=False).fast_forward(1).random(count)
    return [PathPose(*row) for row in qmc.scale(points, (-5.0, -5.0, -math.pi), (5.0, 5.0, math.pi)).tolist()]


def goals_ahead(count: int, nearest_m: float = 0.3) -> list[PathPose]:
    """Spread goals up to 8 m off, within 60° of straight ahead, with headings within 60° of the bearing."""
    rng = np.random.default_rng(5)
    goals: list[PathPose] = []
    while len(goals) < count:
        bearing, onward = (rng.uniform(-1.0, 1.0, 2) * math.pi / 3.0).tolist()
        distance = rng.uniform(0.3, 8.0)
        if distance >= nearest_m:
            goals.append(PathPose(distance * math.cos(bearing), distance * math.sin(bearing), bearing + onward))
    return goals
