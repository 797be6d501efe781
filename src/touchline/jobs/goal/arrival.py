"""Arrival of a robot at its goal: errors and times, as a JSON object."""

import math
from typing import Any, Final, NamedTuple

from touchline.schemas.messages import Odometry, PoseGoal

NEAR_M: Final = 0.02
NEAR_RAD: Final = math.radians(2.0)
"""Accuracy required of a small robot in truth: largest heading error at a goal."""


ARRIVED_M: Final = 0.05
ARRIVED_RAD: Final = NEAR_RAD
"""Largest heading error at rest that still counts as arrived."""


class ReachedPose(NamedTuple):
    """Pose that a robot reached: position (m) and heading (rad), map frame."""

    x_m: float
    y_m: float
    heading_rad: float

    @classmethod
    def of(cls, message: Odometry) -> "ReachedPose":
        """Convert odometry, of which only the turn about z counts."""
        at, turn = message.pose.pose.position, message.pose.pose.orientation
        return cls(at.x, at.y, 2.0 * math.atan2(turn.z, turn.w))

    def off_m(self, goal: PoseGoal) -> float:
        """Return the distance from the goal, m."""
        return math.hypot(self.x_m - goal.x_m, self.y_m - goal.y_m)

    def turned_rad(self, goal: PoseGoal) -> float:
        """Return the heading error, left of the goal's positive, -π to π; NaN if any heading will do."""
        return math.remainder(self.heading_rad - goal.heading_rad, math.tau)


def missed(goal: PoseGoal, believed: ReachedPose | None, true: ReachedPose | None) -> str:
    """Return how a robot at rest missed its goal; empty if it arrived.

    It has arrived within `ARRIVED_M` and `ARRIVED_RAD` by its own estimate and, if it is emulated, in truth.

    Args:
        goal: The goal.
        believed: Estimated pose at rest; None if unknown.
        true: True pose at rest; None if the robot is not emulated.
    """
    for pose, belief in ((believed, ", by its own estimate"), (true, " in truth")):
        if pose is None:
            continue
        off_m, turned_rad = pose.off_m(goal), pose.turned_rad(goal)
        if off_m > ARRIVED_M:
            return f"it rests {off_m:.3f} m from the goal{belief}; at most {ARRIVED_M:g} m counts as arrived"
        if abs(turned_rad) > ARRIVED_RAD:
            turned_deg, most_deg = abs(math.degrees(turned_rad)), math.degrees(ARRIVED_RAD)
            return f"it rests {turned_deg:.1f}° off the goal's heading{belief}; at most {most_deg:g}° counts as arrived"
    return ""


def arrival_figures(
    goal: PoseGoal, planned_s: float, took_s: float, believed: ReachedPose | None, true: ReachedPose | None
) -> dict[str, Any]:
    """Return time and place of the arrival, by the robot's estimate and, if it is emulated, in truth.

    Args:
        goal: The goal.
        planned_s: Planned duration.
        took_s: Duration of the drive, sim time.
        believed: Estimated pose at rest; None if unknown.
        true: True pose at rest; None if the robot is not emulated.
    """
    return {
        "goal": goal_figures(goal),
        "time_s": {"planned": planned_s, "taken": took_s},
        "believed": _off(goal, believed),
        "true": _off(goal, true),
    }


def goal_figures(goal: PoseGoal) -> dict[str, float | None]:
    """Return the goal pose; a heading of ``None`` is any."""
    return {"x_m": goal.x_m, "y_m": goal.y_m, "heading_rad": _finite(goal.heading_rad)}


def _off(goal: PoseGoal, reached: ReachedPose | None) -> dict[str, Any] | None:
    """Return a pose and its distance from the goal; the heading error is left positive."""
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
