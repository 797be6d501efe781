"""Lanes through passages: on the right where two robots have room beside each other, else one direction at a time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.geodesics import Geodesics
from touchline.coordination.plans.leases import Lease
from touchline.coordination.plans.next_legs import Manner, NextLeg, line_of, points_of
from touchline.coordination.plans.passages import Passage

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Complexes = NDArray[np.complex128]

_BEFORE_M: Final = (1.9, 1.4, 0.9, 0.4)
"""Distance before the mouth of the first point of a lane, or less if there is no room…"""
_ASIDE: Final = 0.21
"""…and how far to the right it is, over that distance."""
_MOST_ASIDE_M: Final = 0.45
"""Distance of a lane from the middle line of a passage, at most; else a quarter of its width."""
_NARROW_ASIDE: Final = 0.5
"""The same where there is room for one."""
_QUEUES_M: Final = 0.8
"""Distance from the first point of a lane at which robots without a lease wait."""
_ASKS_M: Final = 3.5
"""Distance before a mouth from which on a robot asks for a lease."""
_EXITS_M: Final = (0.5 - 0.3j, 1.0 - 0.3j, 1.5 - 0.3j)
"""Places behind an exit, ahead and to the right (m)."""
_FREE_M: Final = 0.3
"""Distance of a robot from a place that is free."""
_BEYOND_M: Final = 0.4
"""Distance behind the mouth to which a lane leads."""
_MEETS_M: Final = 4.0
"""Distance within which another robot is a reason to keep to a lane, as is one that goes through the same passage."""
_REACHED_M: Final = 0.5
_AHEAD_M: Final = 0.25
_NEAR_MOUTH_M: Final = 0.3
_SIMPLE_M: Final = 0.02


class PassageLane:
    """Lane through a passage in one direction, on the right of its middle line.

    It begins before the mouth and farther to the right, so that robots come from where they are not in the way of those
    that leave the passage.

    Attributes:
        mouth_m: Distance of the mouth along it.
        narrow: Whether it is the middle line, as there is room for one.
        start: Its first point (m).
    """

    def __init__(self, middle: Complexes, width_m: float, geodesics: Geodesics, two_m: float) -> None:
        """Lay it.

        Args:
            middle: (k,) the middle line in this direction, x + iy (m).
            width_m: Width of the passage.
            geodesics: Ways within the area.
            two_m: Width in which two robots have room beside each other.
        """
        import shapely

        self.narrow = width_m < two_m
        aside_m = 0.0 if self.narrow else min(0.25 * width_m, _MOST_ASIDE_M)
        turned = 1.0 + 1j * (_NARROW_ASIDE if self.narrow else _ASIDE)
        inner = points_of(shapely.offset_curve(line_of(middle).simplify(_SIMPLE_M), -aside_m, join_style="mitre"))
        into, out = _unit(middle[1] - middle[0]), _unit(middle[-1] - middle[-2])
        starts = [complex(inner[0] - before_m * turned * into) for before_m in _BEFORE_M]
        self.start = next((start for start in starts if geodesics.clear(start, complex(inner[0]))), starts[-1])
        self._points = np.concatenate(([self.start], inner, [inner[-1] + _BEYOND_M * out]))
        self._line = line_of(self._points)
        shapely.prepare(self._line)
        self._along_m = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(self._points)))))
        self.mouth_m = float(self._along_m[1])
        self._exits = inner[-1] + out * np.array(_EXITS_M)

    def along_m(self, place: complex) -> float:
        """Return how far along the lane a place is, less than 0 if it is before the lane."""
        import shapely

        along_m = float(self._line.project(shapely.Point(place.real, place.imag)))
        return along_m if along_m > 0.0 else -abs(place - self.start)

    def room(self, places: Complexes) -> int:
        """Return how many places behind its exit are free of robots (m)."""
        off_m = np.abs(self._exits[:, None] - places)
        return int(np.count_nonzero((off_m >= _FREE_M).all(axis=1)))

    def aim(self, along_m: float) -> complex:
        """Return the point to drive at from so far along."""
        if along_m < -_REACHED_M:
            return self.start
        after = int(np.searchsorted(self._along_m, max(along_m, 0.0) + _AHEAD_M))
        return complex(self._points[min(after, len(self._points) - 1)])


class PassageLanes:
    """Ways of robots in an area in which all narrow stretches are passages between rooms.

    Args:
        passages: Its passages.
        geodesics: Ways within it.
        apart_m: Least distance of two robots.
        two_m: Width in which two robots have room beside each other.
    """

    def __init__(self, passages: Sequence[Passage], geodesics: Geodesics, apart_m: float, two_m: float) -> None:
        import shapely

        self._geodesics, self._apart_m = geodesics, apart_m
        self._middles = [line_of(_longer(passage.line)) for passage in passages]
        self._insides = [
            middle.buffer(0.6 * passage.width_m, cap_style="flat")
            for middle, passage in zip(self._middles, passages, strict=True)
        ]
        shapely.prepare(self._insides)
        self._leases = [Lease() for _ in passages]
        self._lanes = [
            PassageLane(line, passage.width_m, geodesics, two_m)
            for passage in passages
            for line in (passage.line, passage.line[::-1])
        ]

    def narrow_at(self, places: Complexes) -> bool:
        """Return whether one of some places (m) is in a passage with room for one."""
        import shapely

        inside = (shapely.contains_xy(each, places.real, places.imag).any() for each in self._insides)
        return any(lane.narrow and within for lane, within in zip(self._lanes[::2], inside, strict=True))

    def legs(self, places: Complexes, goals: Complexes, now_s: float) -> list[NextLeg]:
        """Return the next part of each robot's way.

        Args:
            places: (n,) of the robots (m).
            goals: (n,) m.
            now_s: Time.
        """
        pairs = list(zip(places.tolist(), goals.tolist(), strict=True))
        ways = [NextLeg(*self._geodesics.way(place, goal)) for place, goal in pairs]
        numbers = np.array([self._next_lane(place, goal) for place, goal in pairs])
        before_m = np.array([self._before_m(lane, at) for lane, (at, _) in zip(numbers, pairs, strict=True)])
        may = self._lend(numbers, before_m, places, now_s)
        met = np.abs(places[:, None] - places) < _MEETS_M
        met |= numbers[:, None] // 2 == numbers // 2
        for who in np.flatnonzero((numbers >= 0) & (met.sum(axis=1) > 1)).tolist():
            lane, place = self._lanes[numbers[who]], complex(places[who])
            if not lane.narrow and self._ends_in(numbers[who] // 2, place, complex(goals[who])):
                continue
            aim, waits = lane.start, abs(lane.start - place) < _QUEUES_M
            if may[who]:
                aim = lane.aim(lane.mouth_m - before_m[who])
                waits = self._second(who, may & (numbers == numbers[who]), places, before_m)
            aim, _ = self._geodesics.way(place, aim)
            ways[who] = NextLeg(aim, ways[who].left_m, Manner.WAIT if waits else Manner.LANE)
        return ways

    def _ends_in(self, passage: int, place: complex, goal: complex) -> bool:
        """Return whether a goal that is seen from a place is within a passage: its lane would lead past it (m)."""
        import shapely

        inside = bool(shapely.contains_xy(self._insides[passage], goal.real, goal.imag))
        return inside and self._geodesics.sees(place, goal)

    def _before_m(self, number: int, place: complex) -> float:
        """Return the way from a place to the mouth of a lane (m), less than 0 behind it; inf without a lane."""
        return self._lanes[number].mouth_m - self._lanes[number].along_m(place) if number >= 0 else np.inf

    def _lend(self, numbers: Ints, before_m: Floats, places: Complexes, now_s: float) -> Bools:
        """Bring the leases of narrow passages up to date; return (n,) who may enter the next passage."""
        may = np.ones(len(numbers), dtype=np.bool_)
        for passage, (lease, lane) in enumerate(zip(self._leases, self._lanes[::2], strict=True)):
            if lane.narrow:
                through = numbers // 2 == passage
                ask = np.flatnonzero(through & (before_m < _ASKS_M)).tolist()
                room = (lane.room(places), self._lanes[2 * passage + 1].room(places))
                lease.update(now_s, {who: (int(numbers[who]) % 2, float(before_m[who])) for who in ask}, room)
                may &= ~through | np.isin(np.arange(len(numbers)), list(lease.holders))
        return may

    def _second(self, who: int, alike: NDArray[np.bool_], places: Complexes, before_m: Floats) -> bool:
        """Return whether a robot has to let another one of its lane, given by a mask, enter first.

        Two side by side would jam in the mouth: each has the other on one side, and one has the corner on the other.
        """
        behind_m = before_m[who] - before_m
        beside = (behind_m > 0.0) & (behind_m < self._apart_m) & (np.abs(places - places[who]) < 2.0 * self._apart_m)
        return bool(before_m[who] > 0.0 and (alike & beside).any())

    def _next_lane(self, place: complex, goal: complex) -> int:
        """Return the number of the first lane on the way from a place to a goal; −1: none, or it is seen inside one."""
        import shapely

        if not self._lanes:
            return -1
        nodes = self._geodesics.nodes_to(place, goal)
        inside = np.array([shapely.contains_xy(each, nodes.real, nodes.imag) for each in self._insides])
        if not inside.any():
            return -1
        first = int(inside.any(axis=0).argmax())
        number = int(inside[:, first].argmax())
        outside_again = np.flatnonzero(~inside[number, first:])
        if not len(outside_again) and self._geodesics.sees(place, goal):
            return -1
        last = first + int(outside_again[0]) if len(outside_again) else len(nodes) - 1
        ends = nodes[[max(first - 1, 0), last]]
        along_m = [self._middles[number].project(shapely.Point(end.real, end.imag)) for end in ends.tolist()]
        return 2 * number + int(along_m[1] < along_m[0])


def _unit(way: complex) -> complex:
    return way / abs(way)


def _longer(line: Complexes) -> Complexes:
    """Return a line that begins before, and ends behind, the mouths of its passage."""
    before = line[0] - _NEAR_MOUTH_M * _unit(line[1] - line[0])
    behind = line[-1] + _NEAR_MOUTH_M * _unit(line[-1] - line[-2])
    return np.concatenate(([before], line, [behind]))
