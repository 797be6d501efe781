"""Compiled: limits of drive and plan on speed and acceleration along a path."""

import math
from typing import Any, NamedTuple

import numpy as np

from touchline.core.jit import kernel
from touchline.services.planner.drives import planned_drive as drive
from touchline.services.planner.geometry.clothoid import Floats

# Below this curvature (1/m) a path is straight.
STRAIGHT_1PM = 1e-9


class Caps(NamedTuple):
    """Limits in the form that kernels take.

    Attributes:
        transit_mps: Maximum speed.
        acceleration_mps2: Maximum acceleration along the path.
        lateral_mps2: Maximum lateral acceleration.
        drive: `PlannedDrive.caps`, whose type selects the drive's kernels.
    """

    transit_mps: float
    acceleration_mps2: float
    lateral_mps2: float
    drive: Any


@kernel
def square_cap(curvature: float, sharpness: float, limits: Caps) -> float:
    """Maximum squared speed u = v² (m²/s²) on a cell.

    It is the minimum of what transit speed, drive and lateral acceleration (v²·|κ|) allow.

    Args:
        curvature: Maximum |curvature| of the cell (1/m).
        sharpness: Its |sharpness| (1/m²).
        limits: Limits of drive and plan.
    """
    square = min(limits.transit_mps**2, drive.square_cap(limits.drive, curvature, sharpness))
    if curvature > STRAIGHT_1PM:
        square = min(square, limits.lateral_mps2 / curvature)
    return float(square)


@kernel
def square_caps(curvature: Floats, sharpness: Floats, limits: Caps) -> Floats:
    """Compute `square_cap` for many cells.

    Args:
        curvature: (n,) maximum |curvature| (1/m) of each cell.
        sharpness: (n,) |sharpness| (1/m²) of each cell.
        limits: Limits of drive and plan.

    Returns:
        (n,) maximum u (m²/s²) of each cell.
    """
    square = np.empty(len(curvature))
    for i in range(len(curvature)):
        square[i] = square_cap(curvature[i], sharpness[i], limits)
    return square


@kernel
def gain(square: float, curvature: float, sharpness: float, length: float, limits: Caps) -> float:
    """Maximum acceleration (m/s²) that can be kept throughout a cell; 0 where the drive could only brake.

    Args:
        square: u = v² (m²/s²) at its beginning.
        curvature: Signed curvature at its beginning (1/m).
        sharpness: Signed sharpness, constant over the cell (1/m²).
        length: Length of the cell (m).
        limits: Limits of drive and plan.
    """
    most = min(limits.acceleration_mps2, drive.gain(limits.drive, square, curvature, sharpness, length))
    return float(max(most, 0.0))


@kernel
def spin_time(angle: float, limits: Caps) -> float:
    """Seconds to turn on the spot, from rest to rest.

    The rate rises and falls steadily, so that a point at the drive's lever keeps the transit speed and the
    acceleration that hold for driving straight on.

    Args:
        angle: Magnitude of the turn (rad).
        limits: Limits of drive and plan.
    """
    lever = drive.spin_lever_m(limits.drive)
    rate_gain = limits.acceleration_mps2 / lever
    rate = min(limits.transit_mps / lever, math.sqrt(rate_gain * angle))
    return float(angle / rate + rate / rate_gain)
