"""Where and when a robot came to its goal, as a JSON object."""

import math
from typing import Any, NamedTuple

from touchline.schemas.messages import Odometry, PoseGoal


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


def arrival_figures(
    goal: PoseGoal, planned_s: float, took_s: float, believed: ReachedPose | None, true: ReachedPose | None
) -> dict[str, Any]:
    """When and where it came to rest, as the robot believes and, if it is emulated, in truth."""
    return {
        "goal": {"x_m": goal.x_m, "y_m": goal.y_m, "heading_rad": _given(goal.heading_rad)},
        "time_s": {"planned": planned_s, "taken": took_s},
        "believed": _off(goal, believed),
        "true": _off(goal, true),
    }


def _off(goal: PoseGoal, reached: ReachedPose | None) -> dict[str, Any] | None:
    """A pose, and how far it is from the goal; the heading's error is left positive."""
    if reached is None:
        return None
    x_m, y_m, heading_rad = reached
    any_heading = math.isnan(goal.heading_rad)
    turned_rad = math.nan if any_heading else math.remainder(heading_rad - goal.heading_rad, math.tau)
    return {
        "x_m": x_m,
        "y_m": y_m,
        "heading_rad": math.remainder(heading_rad, math.tau),
        "off_m": math.hypot(x_m - goal.x_m, y_m - goal.y_m),
        "turned_deg": None if any_heading else math.degrees(turned_rad),
    }


def _given(heading_rad: float) -> float | None:
    return heading_rad if math.isfinite(heading_rad) else None
