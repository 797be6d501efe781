"""Speed along a lane by the place on it: a trapezium in time, from rest to rest."""

from __future__ import annotations

import math

from touchline.schemas.onboard import LanePursuit


def lane_speed_mps(done_m: float, left_m: float, p: LanePursuit) -> float:
    """Compute the speed at a place of a lane.

    It is the least of three speeds: reachable since the lane began, the largest, and the one from which the robot can
    still brake to rest. With phases by place, one after the other, the first and the last would overlap on lanes
    shorter than v²/a. To make the robot set off at all, the lane counts as begun ε = v_min²/(2a) before its start.

    Within the tolerance of its end a lane is done, but the profile there is still above v_min; cutting it off would
    brake harder than a. So it is followed to the end, below v_min too.

    Args:
        done_m: Distance since the lane began.
        left_m: Distance to its end.
        p: Speeds, acceleration and tolerance.
    """
    twice = 2.0 * p.acceleration_mps2
    faster = math.sqrt(twice * max(done_m, 0.0) + p.min_speed_mps**2)
    slower = math.sqrt(twice * max(left_m, 0.0))
    speed = min(faster, p.max_speed_mps, slower)
    return speed if left_m <= p.tolerance_m else max(speed, p.min_speed_mps)
