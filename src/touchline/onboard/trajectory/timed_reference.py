"""Reference that moves along the path by its own time: exactly by the speed profile, wherever the robot is."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.angles import wrapped
from touchline.core.jit import kernel

Floats = NDArray[np.float64]


class Reference(NamedTuple):
    """The reference on the path.

    Attributes:
        speed_mps: Speed along the path.
        arc_m: Its arc length.
        entry: Entry of the speed profile at which a search begins.
    """

    speed_mps: float
    arc_m: float
    entry: int


@kernel
def by_profile(speeds: Floats, at: Reference, end_m: float, time_s: float) -> tuple[Reference, float]:
    """Move a reference at the profile's speeds; between two entries its acceleration is constant.

    Args:
        speeds: (m, 2) of `LoadedTrajectory`: arc length [m], speed [m/s]; its square is linear in between.
        at: Place of the reference; the speed is the profile's.
        end_m: Arc length at which it ends.
        time_s: Time to move.

    Returns:
        The moved reference, and the remaining time [s] if it has ended before.
    """
    s, entry, last = at.arc_m, at.entry, speeds.shape[0] - 2
    while entry > 0 and s < speeds[entry, 0]:
        entry -= 1
    while s < end_m:
        while entry < last and s >= speeds[entry + 1, 0]:
            entry += 1
        start_m, span_m = speeds[entry, 0], speeds[entry + 1, 0] - speeds[entry, 0]
        squared = speeds[entry, 1] ** 2
        twice = (speeds[entry + 1, 1] ** 2 - squared) / span_m if span_m > 0.0 else 0.0
        stop_m = min(speeds[entry + 1, 0], end_m) if entry < last else end_m
        v = math.sqrt(max(squared + twice * (s - start_m), 0.0))
        v_stop = math.sqrt(max(squared + twice * (stop_m - start_m), 0.0))
        # Both are 0 only over the millimetre on which a plan may stand still.
        takes_s = 2.0 * (stop_m - s) / (v + v_stop) if v + v_stop > 0.0 else 0.0
        if takes_s > time_s:
            after = v + 0.5 * twice * time_s
            return Reference(max(after, 0.0), s + 0.5 * (v + after) * time_s, entry), 0.0
        s, time_s = stop_m, time_s - takes_s
    return Reference(0.0, end_m, entry), time_s


@kernel
def run_on(
    speeds: Floats, at: Reference, end_m: float, accelerate_mps2: float, time_s: float
) -> tuple[Reference, float]:
    """Move a reference as `by_profile`, but catch up with the profile at a limited acceleration.

    Args:
        speeds: (m, 2) of `LoadedTrajectory`: arc length [m], speed [m/s].
        at: Place and speed of the reference.
        end_m: Arc length at which it ends.
        accelerate_mps2: Acceleration of a reference that is slower than the profile.
        time_s: Time to move.

    Returns:
        The moved reference, and the remaining time [s] if it has ended before.
    """
    planned, left_s = by_profile(speeds, at, end_m, time_s)
    after = at.speed_mps + accelerate_mps2 * time_s
    behind_m = at.arc_m + 0.5 * (at.speed_mps + after) * time_s
    if planned.arc_m <= behind_m:
        return planned, left_s
    return Reference(after, behind_m, planned.entry), 0.0


@kernel
def errors_against(
    pose: tuple[float, float, float], reference: tuple[float, float, float]
) -> tuple[float, float, float]:
    """Compute the pose that a robot should have, relative to its own.

    Args:
        pose: Pose of the robot: x, y [m] and heading [rad] in any one frame.
        reference: Pose it should have, likewise.

    Returns:
        Distance of the reference ahead and to the left in the robot's frame [m], and its heading less the robot's in
            (−π, π] [rad].
    """
    x, y, heading = reference[0] - pose[0], reference[1] - pose[1], pose[2]
    cos, sin = math.cos(heading), math.sin(heading)
    return cos * x + sin * y, cos * y - sin * x, wrapped(reference[2] - heading)
