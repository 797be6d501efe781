"""A lidar's scan: every beam placed on the map at its own time, and classified."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import borrowing, kernel
from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.core.polygons import crossed
from touchline.core.records import Record
from touchline.onboard.computer_state import FilterState
from touchline.onboard.filter_model import EAST, HEADING, NORTH, RING
from touchline.onboard.interface import TICKS_PER_S
from touchline.schemas.vehicles.lidar_spec import FULL_TURN_RAD, LidarSpec

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Kinds of beams.
NOTHING: Final = 0
"""No return, or one beyond the longest range."""
UNUSABLE: Final = 1
"""Below the shortest range, from the robot's own body, or not a number."""
THING: Final = 2
GROUND: Final = 3
"""May be ground."""
KNOWN: Final = 4
"""Explained by an outline that the plan knows."""
UNCONFIRMED: Final = 5
"""Not confirmed by the scans before: may be rain."""

_LEAN_RAD: Final = math.radians(1.0)
"""Uncertainty of the angle between the scanned plane and the ground ahead."""
_GROUND_M: Final = 0.3
"""Least distance by which a thing in front of the predicted ground differs from it."""


class ScanFigures(Record):
    """Data sheet of a lidar as kernels need it."""

    step_rad: float
    scan_s: float
    x_m: float
    y_m: float
    height_m: float
    pitch_rad: float
    min_m: float
    max_m: float
    dark_m: float
    sigma_m: float
    sigma_relative: float
    round: bool
    """True if the last beam is a neighbour of the first."""

    @classmethod
    def of(cls, spec: LidarSpec) -> Self:
        """Return the figures of a data sheet."""
        names = [name for name in cls.dtype.names or () if name != "round"]
        round_ = (spec.beams + 0.5) * spec.step_rad > FULL_TURN_RAD
        return cls(**{name: getattr(spec, name) for name in names}, round=round_)


class Beams(NamedTuple):
    """Beams of a scan in their order.

    Attributes:
        aim: (beams, 2) direction, body frame.
        range_m: (beams,) range [m]; inf without a return.
        kind: (beams,) kind of each.
        rays: (beams, 4) origin and direction, map frame.
        points_m: (beams, 2) place of the return, map frame; undefined without one.
        time_s: (beams,) time of measurement.
    """

    aim: Floats
    range_m: Floats
    kind: Integers
    rays: Floats
    points_m: Floats
    time_s: Floats

    @classmethod
    def of(cls, spec: LidarSpec) -> Self:
        """Return memory for the beams of a lidar."""
        count, bearing = spec.beams, spec.first_rad + np.arange(spec.beams) * spec.step_rad
        aim, kind = np.stack((np.cos(bearing), np.sin(bearing)), 1), np.zeros(count, np.int64)
        return cls(aim, np.empty(count), kind, np.empty((count, 4)), np.empty((count, 2)), np.empty(count))


@kernel
def inside(x: float, y: float, corners: Floats) -> bool:
    """Return whether a point lies in a polygon, by the rule of `crossed`.

    Args:
        x: The point, with `y`.
        y: Its other coordinate.
        corners: (n, 2) corners.
    """
    found, a = False, complex(corners[-1, 0], corners[-1, 1])
    for i in range(len(corners)):
        b = complex(corners[i, 0], corners[i, 1])
        if crossed(complex(x, y), a, b):
            found = not found
        a = b
    return found


@kernel
def sigma_of(lidar: ScanFigures, range_m: float) -> float:
    """Standard deviation of a range's noise [m]."""
    sigma: float = lidar.sigma_m + lidar.sigma_relative * range_m
    return sigma


@kernel
def _may_be_ground(lidar: ScanFigures, range_m: float, down_rad: float, level_rad: float) -> bool:
    """Return whether a range is that of the ground, for all that is known of it.

    Args:
        lidar: Data sheet.
        range_m: Measured range.
        down_rad: Angle of the beam below the ground's plane if the ground goes on as under the robot.
        level_rad: The same if the ground ahead is level.
    """
    steepest = max(down_rad, level_rad) + _LEAN_RAD
    flattest = min(down_rad, level_rad) - _LEAN_RAD
    if steepest <= 0.0:
        return False
    tolerance = max(_GROUND_M, 3.0 * sigma_of(lidar, range_m))
    if range_m < lidar.height_m / math.tan(steepest) - tolerance:
        return False
    return flattest <= 0.0 or range_m <= lidar.height_m / math.tan(flattest) + tolerance


@borrowing
def place_beams(
    lidars: Sequence[ScanFigures],
    stamp_s: float,
    rings: Sequence[FilterState],
    tick: int,
    outline: Floats,
    everywhere: bool,
    beams: Beams,
) -> int:
    """Place every beam where the robot was at its time, and classify it as nothing, unusable, ground or thing.

    Args:
        lidars: (1,) data sheet.
        stamp_s: Time of the last beam.
        rings: (1,) ring of the estimator's states, and the slope of the ground under the robot.
        tick: Tick of the newest of them; the oldest beam is not older than the ring.
        outline: (n, 2) outline of the robot's body, body frame.
        everywhere: False if beams without a return, but for the first and the last, need not be placed.
        beams: `aim` and `range_m` are given; all else is set.

    Returns:
        Number of beams of another kind than NOTHING.
    """
    lidar, states, learned = lidars[0], rings[0].states, rings[0].learned
    rise_east, rise_north = learned.rise_east_mps2 / GRAVITY_MPS2, learned.rise_north_mps2 / GRAVITY_MPS2
    count, reach = len(beams.range_m), 0.0
    for i in range(len(outline)):
        reach = max(reach, outline[i, 0] ** 2 + outline[i, 1] ** 2)
    turned, cos_then, sin_then, returned = -1, 1.0, 0.0, 0
    for i in range(count):
        far = beams.range_m[i]
        if far > lidar.max_m and not everywhere and 0 < i < count - 1:
            beams.kind[i] = NOTHING
            continue
        time_s = stamp_s - lidar.scan_s * (count - 1 - i) / (count - 1)
        at = time_s * TICKS_PER_S
        before = min(math.floor(at + 1e-6), tick)
        share = min(max(at - before, 0.0), 1.0) if before < tick else 0.0
        a, b = states[before % RING], states[min(before + 1, tick) % RING]
        east = a[EAST] + share * (b[EAST] - a[EAST])
        north = a[NORTH] + share * (b[NORTH] - a[NORTH])
        if before != turned:
            turned, cos_then, sin_then = before, math.cos(a[HEADING]), math.sin(a[HEADING])
        turn = share * (b[HEADING] - a[HEADING])
        cos_on, sin_on = 1.0 - 0.5 * turn * turn, turn - turn * turn * turn / 6.0  # a tick's turn is small
        cos, sin = cos_then * cos_on - sin_then * sin_on, sin_then * cos_on + cos_then * sin_on
        ahead, left = beams.aim[i, 0], beams.aim[i, 1]
        x, y = cos * ahead - sin * left, sin * ahead + cos * left
        ray = beams.rays[i]
        ray[0], ray[1] = east + cos * lidar.x_m - sin * lidar.y_m, north + sin * lidar.x_m + cos * lidar.y_m
        ray[2], ray[3] = x, y
        beams.time_s[i] = time_s
        if far > lidar.max_m:
            beams.kind[i] = NOTHING
            continue
        returned += 1
        body_x, body_y = lidar.x_m + far * ahead, lidar.y_m + far * left
        own = body_x * body_x + body_y * body_y <= reach and inside(body_x, body_y, outline)
        if own or not far >= lidar.min_m:
            beams.kind[i] = UNUSABLE
            continue
        beams.points_m[i, 0], beams.points_m[i, 1] = ray[0] + far * x, ray[1] + far * y
        down = lidar.pitch_rad * ahead
        level = down - (rise_east * x + rise_north * y)
        beams.kind[i] = GROUND if _may_be_ground(lidar, far, down, level) else THING
    return returned
