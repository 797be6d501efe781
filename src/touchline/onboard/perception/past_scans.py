"""The last two scans of each lidar: whether they had a return near a place, or looked through it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.onboard.perception.scan import NOTHING, UNCONFIRMED, UNUSABLE, Beams, ScanFigures

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class PastScans(NamedTuple):
    """Last two scans of each lidar, in the rows 2·lidar and 2·lidar + 1 by turns.

    Attributes:
        beams: (2·lidars,) number of beams.
        kind: (2·lidars, most beams) kinds of the beams.
        range_m: (2·lidars, most beams) their ranges [m]; undefined without a return, as the places.
        points_m: (2·lidars, most beams, 2) places of their returns, map frame.
        ends: (2·lidars, 2, 4) rays of the first and the last beam, as in `Beams`.
        time_s: (2·lidars,) time of the last beam; -inf if there was no scan.
    """

    beams: Integers
    kind: Integers
    range_m: Floats
    points_m: Floats
    ends: Floats
    time_s: Floats

    @classmethod
    def of(cls, beams: Sequence[int]) -> Self:
        """Return memory for lidars with these numbers of beams."""
        rows, most = 2 * len(beams), max(beams)
        kind, range_m, points_m = np.zeros((rows, most), np.int64), np.zeros((rows, most)), np.zeros((rows, most, 2))
        return cls(np.repeat(beams, 2), kind, range_m, points_m, np.zeros((rows, 2, 4)), np.full(rows, -math.inf))

    def enter_nothing(self, row: int, beams: Beams) -> None:
        """Enter a scan without any return; of its beams the first and the last are placed."""
        self.kind[row] = NOTHING
        self.ends[row] = beams.rays[[0, -1]]
        self.time_s[row] = beams.time_s[-1]


@kernel
def enter(past: PastScans, row: int, beams: Beams) -> None:
    """Enter a scan with its kinds."""
    last = len(beams.kind) - 1
    for i in range(last + 1):
        past.kind[row, i] = beams.kind[i]
        if beams.kind[i] != NOTHING:
            past.range_m[row, i] = beams.range_m[i]
            past.points_m[row, i, 0], past.points_m[row, i, 1] = beams.points_m[i]
    past.ends[row, 0], past.ends[row, 1] = beams.rays[0], beams.rays[last]
    past.time_s[row] = beams.time_s[last]


@kernel
def _beam_towards(ray: Floats, x: float, y: float, step_rad: float) -> float:
    """Return how many beams after that of a ray one points to a place, if the lidar stands still."""
    turn_rad = math.atan2(y - ray[1], x - ray[0]) - math.atan2(ray[3], ray[2])
    return (turn_rad % (2.0 * math.pi)) / step_rad


@kernel
def _is_near(place: Floats, x: float, y: float, radius_m: float) -> bool:
    return bool((place[0] - x) ** 2 + (place[1] - y) ** 2 <= radius_m * radius_m)


@kernel
def look_back(
    lidar: ScanFigures, past: PastScans, row: int, hint: int, x: float, y: float, radius_m: float
) -> tuple[bool, bool, bool]:
    """Look for returns of a past scan near a place.

    Args:
        lidar: Data sheet.
        past: The scans.
        row: Row of the scan.
        hint: Beam that is likely to have one; -1: none.
        x: East of the place [m].
        y: North of the place [m].
        radius_m: Farthest distance that is near.

    Returns:
        Whether the scan had a return near the place; if not, whether some of what is near was hidden from it, by
        something nearer or because no beam reaches that far on dark things; and whether it was outside its sector.
    """
    if past.time_s[row] == -math.inf:
        return False, True, True
    if hint >= 0 and past.kind[row, hint] > UNUSABLE and _is_near(past.points_m[row, hint], x, y, radius_m):
        return True, False, False
    ends, count = past.ends[row], past.beams[row]
    turn = math.floor(2.0 * math.pi / lidar.step_rad + 0.5)
    distance_m = min(math.hypot(x - ends[0, 0], y - ends[0, 1]), math.hypot(x - ends[1, 0], y - ends[1, 1]))
    # The lidar moves and turns meanwhile: a beam in between points there from between its first and its last pose.
    first = _beam_towards(ends[0], x, y, lidar.step_rad)
    on = (_beam_towards(ends[1], x, y, lidar.step_rad) + count - 1 - first + 0.5 * turn) % turn - 0.5 * turn
    beside = 0.5 * turn
    if distance_m > radius_m:
        beside = math.asin(radius_m / distance_m) / lidar.step_rad + 1.0
    begin = math.floor(first + min(on, 0.0) - beside)
    end = min(math.ceil(first + max(on, 0.0) + beside), begin + turn - 1)
    hidden, outside = False, False
    for beam in range(begin, end + 1):
        i = beam % turn
        if i >= count:
            outside = True
            continue
        kind = past.kind[row, i]
        if kind == UNUSABLE:  # twice, that is a part of the robot; once, a drop
            hidden |= past.kind[row ^ 1, i] == UNUSABLE
        elif kind == NOTHING:
            hidden |= distance_m + radius_m > lidar.dark_m
        else:
            if _is_near(past.points_m[row, i], x, y, radius_m):
                return True, False, False
            hidden |= kind != UNCONFIRMED and past.range_m[row, i] < distance_m - radius_m
    return False, hidden, outside
