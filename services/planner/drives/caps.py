"""Compiled: limits of speed and acceleration along a path, those of the drive and those of the plan together."""

import math
from typing import Any, NamedTuple

import numpy as np

from touchline.core.jit import kernel
from touchline.services.planner.drives import planned_drive as drive
from touchline.services.planner.geometry.clothoid import Floats

# Below this curvature (1/m) a path is straight.
STRAIGHT_1PM = 1e-9


class Caps(NamedTuple):
    """The limits that the kernels take.

    Attributes:
        transit_mps: No speed is above.
        acceleration_mps2: Along the path.
        lateral_mps2: Across it.
        drive: `PlannedDrive.caps`: the type of this decides which drive's kernels they are compiled with.
    """

    transit_mps: float
    acceleration_mps2: float
    lateral_mps2: float
    drive: Any


@kernel
def square_cap(curvature: float, sharpness: float, limits: Caps) -> float:
    """The largest squared speed u = v² (m²/s²) on a cell.

    It is the least of what transit speed, drive and lateral acceleration (v²·|κ|) allow.

    Args:
        curvature: The cell's largest |curvature| (1/m).
        sharpness: Its |sharpness| (1/m²).
        limits: Of drive and plan.
    """
    square = min(limits.transit_mps**2, drive.square_cap(limits.drive, curvature, sharpness))
    if curvature > STRAIGHT_1PM:
        square = min(square, limits.lateral_mps2 / curvature)
    return float(square)


@kernel
def square_caps(curvature: Floats, sharpness: Floats, limits: Caps) -> Floats:
    """`square_cap` for many cells.

    Args:
        curvature: (n,) the largest |curvature| (1/m) of each cell.
        sharpness: (n,) their |sharpness| (1/m²).
        limits: Of drive and plan.

    Returns:
        (n,) the largest u (m²/s²) of each.
    """
    square = np.empty(len(curvature))
    for i in range(len(curvature)):
        square[i] = square_cap(curvature[i], sharpness[i], limits)
    return square


@kernel
def gain(square: float, curvature: float, sharpness: float, length: float, limits: Caps) -> float:
    """The largest acceleration (m/s²) that can be kept throughout a cell; 0 where the drive could only brake.

    Args:
        square: u = v² (m²/s²) at its beginning.
        curvature: Signed, at its beginning (1/m).
        sharpness: Signed, constant over the cell (1/m²).
        length: Of the cell (m).
        limits: Of drive and plan.
    """
    most = min(limits.acceleration_mps2, drive.gain(limits.drive, square, curvature, sharpness, length))
    return float(max(most, 0.0))


@kernel
def spin_time(angle: float, limits: Caps) -> float:
    """Seconds to turn on the spot, from standstill to standstill.

    The rate rises and falls steadily, so that a point at the drive's lever keeps the transit speed and the
    acceleration that hold for driving straight on.

    Args:
        angle: By how much, without a sign (rad).
        limits: Of drive and plan.
    """
    lever = drive.spin_lever_m(limits.drive)
    rate_gain = limits.acceleration_mps2 / lever
    rate = min(limits.transit_mps / lever, math.sqrt(rate_gain * angle))
    return float(angle / rate + rate / rate_gain)
