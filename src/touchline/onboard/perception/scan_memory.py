"""Memory of a lidar's last scans: which returns are confirmed by them, and which of them a scan has missed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import borrowing, kernel
from touchline.onboard.perception.scan import GROUND, NOTHING, THING, UNCONFIRMED, Beams, ScanFigures

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_CELLS: Final = 128
"""Cells of a side of the memory, a power of two; places farther apart may share one, which only confirms more."""
_MASK: Final = _CELLS - 1
_GROUND_CELL_M: Final = 0.25
_MOVED_M: Final = 0.6
"""Way of the robot after which a return that stayed in its cell of 0.25 m is none of ground: that moves along."""
_STAYED_SCANS: Final = 3


class ScanMemory(NamedTuple):
    """Memory of the returns of the last scans, by cells of the map, and of the confirmed ones, by their places.

    Attributes:
        scans: (3,) number of the last scan, of the points in `confirmed_m`, and of those in `missed_m`.
        seen: (_CELLS, _CELLS) number of the last scan with a return in this cell.
        ground_seen: (_CELLS, _CELLS) the same of returns that may be ground, in smaller cells.
        ground_scans: (_CELLS, _CELLS) number of scans with such a return since there was none.
        ground_from_m: (_CELLS, _CELLS) way of the robot before the first of these scans.
        confirmed_m: (beams, 2) returns of the last scan that an earlier one has confirmed.
        missed_m: (beams, 2) those of the scan before in whose direction the last one had no return.
    """

    scans: Integers
    seen: Integers
    ground_seen: Integers
    ground_scans: Integers
    ground_from_m: Floats
    confirmed_m: Floats
    missed_m: Floats

    @classmethod
    def of(cls, beams: int) -> Self:
        """Return an empty memory for a lidar with this number of beams."""
        # The first scan has number 3: two scans after "never", which is 0.
        seen, ground_seen, ground_scans = (np.zeros((_CELLS, _CELLS), np.int64) for _ in range(3))
        points = np.zeros((beams, 2)), np.zeros((beams, 2))
        return cls(np.array([2, 0, 0]), seen, ground_seen, ground_scans, np.zeros((_CELLS, _CELLS)), *points)

    @property
    def may_miss(self) -> bool:
        """True if a scan without any return misses a confirmed one."""
        return bool(self.scans[1] > 0)

    def take_nothing(self) -> None:
        """Do what `confirm` does for a scan without any return that misses nothing."""
        self.scans[0] += 1
        self.scans[2] = 0


@kernel
def _cell(value_m: float, size_m: float) -> int:
    return math.floor(value_m / size_m) & _MASK


@kernel
def _seen_lately(memory: ScanMemory, x: float, y: float, cell_m: float) -> bool:
    """Return whether one of the two scans before had a return in this cell or one beside it."""
    i, j = _cell(x, cell_m), _cell(y, cell_m)
    for k in range(i - 1, i + 2):
        for n in range(j - 1, j + 2):
            if memory.scans[0] - memory.seen[k & _MASK, n & _MASK] <= 2:
                return True
    return False


@kernel
def _stays(memory: ScanMemory, x: float, y: float, way_m: float) -> bool:
    """Note a return that may be ground; return whether it has stayed put while the robot moved."""
    i, j, scan = _cell(x, _GROUND_CELL_M), _cell(y, _GROUND_CELL_M), memory.scans[0]
    since = scan - memory.ground_seen[i, j]
    if since > 2:
        memory.ground_scans[i, j], memory.ground_from_m[i, j] = 0, way_m
    if since > 0:
        memory.ground_scans[i, j] += 1
        memory.ground_seen[i, j] = scan
    moved = way_m - memory.ground_from_m[i, j] >= _MOVED_M
    return bool(moved and memory.ground_scans[i, j] >= _STAYED_SCANS)


@kernel
def _without_return(lidar: ScanFigures, x: float, y: float, beams: Beams) -> bool:
    """Return whether the beams in the direction of a place, and those beside them, have no return."""
    count = len(beams.kind)
    last = beams.rays[count - 1]
    bearing = math.atan2(y - last[1], x - last[0]) - math.atan2(last[3], last[2])
    steps = math.floor(bearing / lidar.step_rad + 0.5) + count - 1
    turn = math.floor(2.0 * math.pi / lidar.step_rad + 0.5)
    for k in range(steps - 1, steps + 2):
        i = k % turn
        if i >= count or beams.kind[i] != NOTHING:
            return False
    return True


@borrowing
def confirm(
    lidars: Sequence[ScanFigures], beams: Beams, near_m: float, cell_m: float, way_m: float, memory: ScanMemory
) -> None:
    """Confirm the returns of a scan by the two before, and find the confirmed ones that this scan has missed.

    A return beyond `near_m` counts if one of the two scans before had one close to it: a thing is seen again, rain is
    not. A confirmed return in whose direction there is none now stays for this scan: it may have been missed.

    Args:
        lidars: (1,) data sheet.
        beams: The scan; unconfirmed things, and returns that turn out not to be ground, change their kind.
        near_m: Range up to which every return counts at once.
        cell_m: Way of the fastest thing in two scans, and errors.
        way_m: Way that the robot has driven.
        memory: Memory of this lidar; changed.
    """
    lidar = lidars[0]
    memory.scans[0] += 1
    missed = 0
    for i in range(memory.scans[1]):
        x, y = memory.confirmed_m[i]
        if _without_return(lidar, x, y, beams):
            memory.missed_m[missed, 0], memory.missed_m[missed, 1] = x, y
            missed += 1
    confirmed = 0
    for i in range(len(beams.kind)):
        x, y = beams.points_m[i]
        if beams.kind[i] == GROUND and _stays(memory, x, y, way_m):
            beams.kind[i] = THING
        if beams.kind[i] != THING:
            continue
        if _seen_lately(memory, x, y, cell_m):
            memory.confirmed_m[confirmed, 0], memory.confirmed_m[confirmed, 1] = x, y
            confirmed += 1
        elif beams.range_m[i] > near_m:
            beams.kind[i] = UNCONFIRMED
    for i in range(len(beams.kind)):
        if beams.kind[i] == THING or beams.kind[i] == UNCONFIRMED:
            x, y = beams.points_m[i]
            memory.seen[_cell(x, cell_m), _cell(y, cell_m)] = memory.scans[0]
    memory.scans[1], memory.scans[2] = confirmed, missed
