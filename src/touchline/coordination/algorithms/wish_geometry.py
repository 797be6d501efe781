"""Places and velocities that wishes mean."""

from __future__ import annotations

import math
from typing import Final

from touchline.coordination.algorithms.team_algorithm import GoalWish, PathWish, TwistWish, VelocityWish

ALONG_M: Final = (0.6, 0.45, 0.3, 0.15)
"""Distances along a path at which a robot drives: the first, or where a corner is before it, one of the others."""


def velocity_of(wish: VelocityWish | TwistWish, heading_rad: float, period_s: float) -> complex:
    """Return the velocity (m/s) that a robot should have after a period.

    Args:
        wish: A velocity or a twist.
        heading_rad: Heading now.
        period_s: Time from one update to the next.
    """
    if isinstance(wish, VelocityWish):
        return complex(wish.x_mps, wish.y_mps)
    turned = heading_rad + wish.yaw_rate_radps * period_s
    return wish.speed_mps * complex(math.cos(turned), math.sin(turned))


def aim_of(wish: GoalWish | PathWish, here: complex, along_m: float = ALONG_M[0]) -> complex:
    """Return the place (m) to drive at: the goal, or a place some way along the path from where it is nearest."""
    if isinstance(wish, GoalWish):
        return complex(wish.x_m, wish.y_m)
    import shapely

    points = list(wish.points_m)
    if len(points) == 1:
        return complex(*points[0])
    line = shapely.LineString(points)
    ahead = line.interpolate(line.project(shapely.Point(here.real, here.imag)) + along_m)
    return complex(ahead.x, ahead.y)
