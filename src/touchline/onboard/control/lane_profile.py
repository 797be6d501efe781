"""The speed along a lane by the place on it: a trapezium in time, from rest to rest."""

from __future__ import annotations

import math

from touchline.schemas.onboard import LanePursuit


def lane_speed_mps(done_m: float, left_m: float, p: LanePursuit) -> float:
    """The speed at a place of a lane.

    The least of three: what has been reached since the lane began, the fastest, and what can still be braked to rest.
    Taken one after the other by place, the first and the last would overlap on lanes shorter than v²/a. So that it sets
    off at all, the lane counts as begun ε = v_min²/(2a) before its begin.

    Within the tolerance of its end a lane is done, but the profile still asks for more than v_min there: cut off, that
    would be harder braking than a. So it is followed to the end, below v_min too.

    Args:
        done_m: Since the lane began.
        left_m: To its end.
        p: Speeds, acceleration and tolerance.
    """
    twice = 2.0 * p.acceleration_mps2
    faster = math.sqrt(twice * max(done_m, 0.0) + p.min_speed_mps**2)
    slower = math.sqrt(twice * max(left_m, 0.0))
    speed = min(faster, p.max_speed_mps, slower)
    return speed if left_m <= p.tolerance_m else max(speed, p.min_speed_mps)
