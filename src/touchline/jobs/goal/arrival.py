"""Where and when a robot came to its goal, as a JSON object."""

import math
from typing import Any, Final, NamedTuple

from touchline.schemas.messages import Odometry, PoseGoal

NEAR_M: Final = 0.02
NEAR_RAD: Final = math.radians(2.0)
"""What a small robot is to keep to in truth: so near to a goal, and so little turned."""


ARRIVED_M: Final = 0.05
ARRIVED_RAD: Final = NEAR_RAD
"""How far off its goal a robot that came to rest has arrived nevertheless."""


class ReachedPose(NamedTuple):
    """Where a robot is: position (m) and heading (rad), map frame."""

    x_m: float
    y_m: float
    heading_rad: float

    @classmethod
    def of(cls, told: Odometry) -> "ReachedPose":
        """From odometry, of which the turn about z counts."""
        at, turn = told.pose.pose.position, told.pose.pose.orientation
        return cls(at.x, at.y, 2.0 * math.atan2(turn.z, turn.w))

    def off_m(self, goal: PoseGoal) -> float:
        """How far from the goal."""
        return math.hypot(self.x_m - goal.x_m, self.y_m - goal.y_m)

    def turned_rad(self, goal: PoseGoal) -> float:
        """By how much its heading is to the left of the goal's, -π to π; NaN if any will do."""
        return math.remainder(self.heading_rad - goal.heading_rad, math.tau)


def missed(goal: PoseGoal, believed: ReachedPose | None, true: ReachedPose | None) -> str:
    """How a robot that came to rest missed its goal; empty if it is there.

    It is there within `ARRIVED_M` and `ARRIVED_RAD` as it believes and, if it is emulated, in truth.
    """
    for pose, belief in ((believed, ", as it believes"), (true, " in truth")):
        if pose is None:
            continue
        off_m, turned_rad = pose.off_m(goal), pose.turned_rad(goal)
        if off_m > ARRIVED_M:
            return f"it rests {off_m:.3f} m from the goal{belief}; at most {ARRIVED_M:g} m is arrived"
        if abs(turned_rad) > ARRIVED_RAD:
            turned_deg, most_deg = abs(math.degrees(turned_rad)), math.degrees(ARRIVED_RAD)
            return f"it rests {turned_deg:.1f}° off the goal's heading{belief}; at most {most_deg:g}° is arrived"
    return ""


def arrival_figures(
    goal: PoseGoal, planned_s: float, took_s: float, believed: ReachedPose | None, true: ReachedPose | None
) -> dict[str, Any]:
    """When and where it came to rest, as the robot believes and, if it is emulated, in truth."""
    return {
        "goal": goal_figures(goal),
        "time_s": {"planned": planned_s, "taken": took_s},
        "believed": _off(goal, believed),
        "true": _off(goal, true),
    }


def goal_figures(goal: PoseGoal) -> dict[str, float | None]:
    """The pose itself; a heading of ``None`` is any."""
    return {"x_m": goal.x_m, "y_m": goal.y_m, "heading_rad": _finite(goal.heading_rad)}


def _off(goal: PoseGoal, reached: ReachedPose | None) -> dict[str, Any] | None:
    """A pose, and how far it is from the goal; the heading's error is left positive."""
    if reached is None:
        return None
    return {
        "x_m": reached.x_m,
        "y_m": reached.y_m,
        "heading_rad": math.remainder(reached.heading_rad, math.tau),
        "off_m": reached.off_m(goal),
        "turned_deg": _finite(math.degrees(reached.turned_rad(goal))),
    }


def _finite(number: float) -> float | None:
    return number if math.isfinite(number) else None
