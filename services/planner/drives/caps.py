"""Compiled: how fast and how hard a vehicle drives along a path, by its drive and by what plans allow it."""

import math
from typing import Any, NamedTuple

import numpy as np

from touchline.services.core.jit import kernel
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
    """The largest u at |curvature| (1/m) and |sharpness| (1/m²)."""
    square = min(limits.transit_mps**2, drive.square_cap(limits.drive, curvature, sharpness))
    if curvature > STRAIGHT_1PM:
        square = min(square, limits.lateral_mps2 / curvature)
    return float(square)


@kernel
def square_caps(curvature: Floats, sharpness: Floats, limits: Caps) -> Floats:
    """The largest u (n,) at |curvature| (1/m) and |sharpness| (1/m²) (n,)."""
    square = np.empty(len(curvature))
    for i in range(len(curvature)):
        square[i] = square_cap(curvature[i], sharpness[i], limits)
    return square


@kernel
def gain(square: float, curvature: float, sharpness: float, length: float, limits: Caps) -> float:
    """The largest acceleration (m/s²) over a cell that is entered with u = `square` at `curvature`."""
    most = min(limits.acceleration_mps2, drive.gain(limits.drive, square, curvature, sharpness, length))
    return float(max(most, 0.0))


@kernel
def spin_time(angle: float, limits: Caps) -> float:
    """Seconds to turn on the spot by |angle| (rad): what lies at the drive's lever within acceleration and speed."""
    lever = drive.spin_lever_m(limits.drive)
    rate_gain = limits.acceleration_mps2 / lever
    rate = min(limits.transit_mps / lever, math.sqrt(rate_gain * angle))
    return float(angle / rate + rate / rate_gain)
