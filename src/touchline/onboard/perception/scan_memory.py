"""Memory of a lidar's last scans: which returns are confirmed by them, and which of them a scan has missed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import borrowing, kernel
from touchline.onboard.perception.past_scans import PastScans, enter, look_back
from touchline.onboard.perception.scan import GROUND, NOTHING, THING, UNCONFIRMED, Beams, ScanFigures

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_CELLS: Final = 128
"""Cells of a side of the memory, a power of two; places farther apart may share one."""
_MASK: Final = _CELLS - 1
_GROUND_CELL_M: Final = 0.25
_MOVED_M: Final = 0.6
"""Way of the robot after which a return that stayed in its cell of 0.25 m is none of ground: that moves along."""
_STAYED_SCANS: Final = 3
_ALIKE_M: Final = 0.15
"""Distance between two returns of one thing that has not moved: errors, and legs that are faster than who walks."""
_BESIDE: Final = 2
"""Beams to either side that may have returned from the same thing."""
_OTHERS: Final = 2
"""Other returns of the same thing that confirm one."""


class Rules(NamedTuple):
    """Rules by which a return counts.

    Attributes:
        near_m: Range up to which there is no time to wait for two more scans.
        thing_mps: Speed of the fastest thing.
        all_round: True if the lidars together leave no direction out.
    """

    near_m: float
    thing_mps: float
    all_round: bool


class ScanMemory(NamedTuple):
    """Memory of the returns of the last scans, of the confirmed ones, and of those that may be ground.

    Attributes:
        scans: (3,) number of the last scan, of the points in `confirmed_m`, and of those in `missed_m`.
        ground_seen: (_CELLS, _CELLS) number of the last scan with a return in this cell that may be ground.
        ground_scans: (_CELLS, _CELLS) number of scans with such a return since there was none.
        ground_from_m: (_CELLS, _CELLS) way of the robot before the first of these scans.
        confirmed_m: (beams, 2) returns of the last scan that an earlier one has confirmed.
        missed_m: (beams, 2) those of the scan before in whose direction the last one had no return.
    """

    scans: Integers
    ground_seen: Integers
    ground_scans: Integers
    ground_from_m: Floats
    confirmed_m: Floats
    missed_m: Floats

    @classmethod
    def of(cls, beams: int) -> Self:
        """Return an empty memory for a lidar with this number of beams."""
        # The first scan has number 3: two scans after "never", which is 0.
        ground_seen, ground_scans = (np.zeros((_CELLS, _CELLS), np.int64) for _ in range(2))
        confirmed_m, missed_m = (np.zeros((beams, 2)) for _ in range(2))
        ground_from_m = np.zeros((_CELLS, _CELLS))
        return cls(np.array([2, 0, 0]), ground_seen, ground_scans, ground_from_m, confirmed_m, missed_m)

    @property
    def may_miss(self) -> bool:
        """True if a scan without any return misses a confirmed one."""
        return bool(self.scans[1] > 0)

    def take_nothing(self, which: int, beams: Beams, past: PastScans) -> None:
        """Do what `confirm` does for a scan without any return that misses nothing."""
        self.scans[0] += 1
        self.scans[2] = 0
        past.enter_nothing(2 * which + int(self.scans[0]) % 2, beams)


@kernel
def _cell(value_m: float) -> int:
    return math.floor(value_m / _GROUND_CELL_M) & _MASK


@kernel
def _stays(memory: ScanMemory, x: float, y: float, way_m: float) -> bool:
    """Note a return that may be ground; return whether it has stayed put while the robot moved."""
    i, j, scan = _cell(x), _cell(y), memory.scans[0]
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


@kernel
def _beside(beams: Beams, i: int, alike_m: float) -> int:
    """Return the number of returns of neighbouring beams that lie close to that of a beam."""
    count, found = len(beams.kind), 0
    x, y = beams.points_m[i]
    for k in range(i - _BESIDE, i + _BESIDE + 1):
        n = k % count
        if n != i and (beams.kind[n] == THING or beams.kind[n] == UNCONFIRMED):
            found += math.hypot(beams.points_m[n, 0] - x, beams.points_m[n, 1] - y) <= alike_m
    return found


@kernel
def _others_look_through(
    lidars: Sequence[ScanFigures],
    which: int,
    past: PastScans,
    place: complex,
    radius_m: float,
    thing_mps: float,
    together: bool,
) -> bool:
    """Return whether another lidar looked through all that is near a place, or, `together`, none had it hidden."""
    now_s = max(past.time_s[2 * which], past.time_s[2 * which + 1])
    for other in range(len(lidars)):
        if other == which:
            continue
        row = 2 * other + int(past.time_s[2 * other + 1] > past.time_s[2 * other])
        near_m = radius_m + thing_mps * abs(now_s - past.time_s[row])
        seen, hidden, outside = look_back(lidars[other], past, row, -1, place.real, place.imag, near_m)
        if seen:
            return False
        if not (hidden or outside):
            return True
        together = together and not hidden
    return together


@kernel
def _evidence(
    lidars: Sequence[ScanFigures], which: int, beams: Beams, i: int, rules: Rules, last: int, past: PastScans
) -> tuple[bool, bool]:
    """Return whether a return counts, and whether an earlier scan had one of the same thing."""
    lidar, now_s, range_m, before = lidars[which], beams.time_s[i], beams.range_m[i], last ^ 1
    alike_m = _ALIKE_M + _BESIDE * range_m * lidar.step_rad
    x, y = beams.points_m[i]
    radius_m = alike_m + rules.thing_mps * (now_s - past.time_s[last])
    again, hidden, outside = look_back(lidar, past, last, i, x, y, radius_m)
    others = _beside(beams, i, alike_m) + again
    if others >= _OTHERS and again:
        return True, True
    again_before, _, _ = look_back(
        lidar, past, before, i, x, y, alike_m + rules.thing_mps * (now_s - past.time_s[before])
    )
    if others + again_before >= _OTHERS:
        return True, again or again_before
    appeared = range_m <= rules.near_m and not again and (hidden or outside)
    if appeared and len(lidars) > 1:
        together = rules.all_round and not hidden
        appeared = not _others_look_through(lidars, which, past, complex(x, y), radius_m, rules.thing_mps, together)
    return appeared, again or again_before


@borrowing
def confirm(
    lidars: Sequence[ScanFigures],
    which: int,
    beams: Beams,
    rules: Rules,
    way_m: float,
    memory: ScanMemory,
    past: PastScans,
) -> None:
    """Confirm the returns of a scan, and find those confirmed earlier that this scan has missed.

    A return counts if two others are of the same thing, beside it or in the two scans before: rain is not seen again. A
    near one counts at once unless the scan before looked through all the ground that a thing can have come from. A
    confirmed return in whose direction there is none now stays for this scan: it may have been missed.

    Args:
        lidars: (lidars,) data sheets.
        which: Number of the lidar.
        beams: The scan; unconfirmed things, and returns that turn out not to be ground, change their kind.
        rules: Rules by which a return counts.
        way_m: Way that the robot has driven.
        memory: Memory of this lidar; changed.
        past: Last scans of all; this one is entered.
    """
    lidar, last = lidars[which], 2 * which + memory.scans[0] % 2
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
        counts, again = _evidence(lidars, which, beams, i, rules, last, past)
        if not counts:
            beams.kind[i] = UNCONFIRMED
        elif again:
            memory.confirmed_m[confirmed, 0], memory.confirmed_m[confirmed, 1] = x, y
            confirmed += 1
    enter(past, last ^ 1, beams)
    memory.scans[1], memory.scans[2] = confirmed, missed
