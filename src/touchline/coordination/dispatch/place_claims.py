"""Use of places by one robot at a time: who goes first, who waits, and where idle robots make room."""

from __future__ import annotations

import cmath
import math
from collections.abc import Collection, Iterable, Sequence
from typing import Final

import numpy as np

from touchline.coordination.dispatch.robot_records import RobotRecord
from touchline.coordination.free_area import FreeArea
from touchline.coordination.tasks import ARRIVED_M

_NEAR: Final = 6.0
"""A robot claims its target within so many radii, or waits there."""
_APART: Final = 3.0
"""Two targets that are nearer than so many radii are used one after the other."""
_RESTS_APART: Final = 2.5
"""Distance of resting robots, in radii."""
_RINGS: Final = (4.0, 6.0, 9.0, 12.0, 16.0, 24.0)
"""Radii of rings on which a robot looks for a place to rest, in radii of robots."""
_BEARINGS: Final = 16


class PlaceClaims:
    """Claims on places.

    Args:
        area: The area.
        radius_m: Radius that each robot keeps free.
        wall_m: Distance that robots keep from walls.
    """

    def __init__(self, area: FreeArea, radius_m: float, wall_m: float) -> None:
        self._area, self._radius_m, self._wall_m = area, radius_m, wall_m

    def hold(self, robots: Iterable[RobotRecord], now_s: float) -> None:
        """Let robots near to their targets wait for those that came there before."""
        near = []
        for robot in robots:
            target = robot.target
            if target is None or abs(robot.place - target) > _NEAR * self._radius_m:
                robot.claim_s, robot.held, robot.waits_for = math.inf, None, ""
                continue
            robot.claim_s = min(robot.claim_s, now_s)
            near.append(robot)
        near.sort(key=lambda robot: (robot.claim_s, robot.name))
        for number, robot in enumerate(near):
            first = self._first_at(robot, near[:number])
            if first is None:
                robot.held, robot.waits_for = None, ""
            else:
                robot.held = robot.place if robot.held is None else robot.held
                robot.waits_for = first.name

    def _first_at(self, robot: RobotRecord, earlier: Sequence[RobotRecord]) -> RobotRecord | None:
        """Return who uses the place that a robot wants, of those that claimed theirs before."""
        for other in earlier:
            if other.held is None and self._meet(other.target, robot.target):
                return other
        return None

    def _meet(self, one: complex | None, other: complex | None) -> bool:
        return one is not None and other is not None and abs(one - other) < _APART * self._radius_m

    def taken_by(self, robot: RobotRecord, robots: Iterable[RobotRecord]) -> str:
        """Return which of some robots stands so near to the target of another that it cannot arrive; "": none."""
        reach_m = 2.0 * self._radius_m - ARRIVED_M
        for other in robots:
            if robot.target is not None and abs(other.place - robot.target) < reach_m:
                return other.name
        return ""

    def make_room(self, robot: RobotRecord, robots: Sequence[RobotRecord], docks: Collection[complex]) -> bool:
        """Move the place at which an idle robot rests if others need it; return whether it had to."""
        others = [each for each in robots if each is not robot]
        wanted = [each.target for each in others if each.target is not None]
        rests = [each.place if each.out else each.rest for each in others if each.target is None]
        if self._is_free(robot.rest, [*wanted, *docks], rests):
            return False
        for place in self._candidates(robot, others):
            if self._is_free(place, [*wanted, *docks], rests):
                robot.rest = place
                return True
        return False

    def _is_free(self, place: complex, wanted: Iterable[complex], rests: Iterable[complex]) -> bool:
        radius_m = self._radius_m
        return all(abs(place - each) >= _APART * radius_m for each in wanted) and all(
            abs(place - each) >= _RESTS_APART * radius_m for each in rests
        )

    def _candidates(self, robot: RobotRecord, others: Iterable[RobotRecord]) -> list[complex]:
        """Return places where it might rest, the nearest first."""
        turns = [cmath.rect(1.0, math.tau * k / _BEARINGS) for k in range(_BEARINGS)]
        ring = [robot.place + self._radius_m * out * turn for out in _RINGS for turn in turns]
        found = [robot.home, *(each.home for each in others), *ring]
        inside = self._area.holds(np.array([(each.real, each.imag) for each in found]), self._wall_m)
        free = [each for each, there in zip(found, inside.tolist(), strict=True) if there]
        return sorted(free, key=lambda each: abs(each - robot.place))
