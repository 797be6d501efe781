"""Ways of robots in an area in which they must go one after another: in corridors with room for one, and in mazes.

An order of moves is planned when goals stand still (`move_order.py`). A robot may make a move once others have made
theirs that come before it and near to it; the graph of these is that of Hönig et al., "Persistent and robust execution
of MAPF schedules in warehouses", IEEE RA-L 4(2), 2019. It has no circle, so however late robots are, one can always go
on. Robots that have no move yet wait on their places.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.geodesics import Geodesics
from touchline.coordination.plans.move_map import CLEARER_M, MoveMap, move_map_of
from touchline.coordination.plans.move_order import Move, MoveOrder
from touchline.coordination.plans.next_legs import Manner, NextLeg, line_of, points_of

Complexes = NDArray[np.complex128]

_MOST_NODES: Final = 40_000
"""Size of the grid of an area in which orders are planned: 400 m²."""
_DONE_M: Final = 0.1
"""Way that may be left of a move that counts as made."""
_BESIDE_M: Final = 0.15
"""Distance from it, at most."""
_OFF_M: Final = 0.1
"""Distance to which a robot may take short cuts."""
_STEP_M: Final = 0.1
_SIGHT_M: Final = 2.5
_RETURN_M: Final = 0.05
"""Way ahead of the nearest point of its way, at which a robot drives that has got off it beside a wall."""
_SAME_M: Final = 1e-6
_CALM_UPDATES: Final = 12
"""Updates for which goals must not have changed before an order is planned, which takes seconds in a large area."""
_AT_M: Final = 0.03
"""Distance from a goal, its own or another's, at which a robot counts as standing there."""


class OrderedWays:
    """Ways of a team's robots, one after another.

    Args:
        geodesics: Ways within the area.
        apart_m: Least distance of two robots.
    """

    def __init__(self, geodesics: Geodesics, apart_m: float) -> None:
        self._geodesics, self._apart_m = geodesics, apart_m
        self._goals: Complexes | None = None
        self._plan: _Plan | None = None
        self._planned, self._calm = False, 0

    def legs(self, places: Complexes, rests: Complexes, goals: Complexes) -> list[NextLeg] | None:
        """Return the next part of each robot's way; None while there is no order, as goals move on or none is found.

        Args:
            places: (n,) of the robots (m).
            rests: (n,) where they would come to rest now (m).
            goals: (n,) m.
        """
        if self._goals is None:
            self._goals, self._calm = goals.copy(), _CALM_UPDATES  # those that are first need not stand still
        elif np.abs(goals - self._goals).max() > _SAME_M:
            self._goals, self._plan, self._planned, self._calm = goals.copy(), None, False, 0
        if self._calm < _CALM_UPDATES:
            self._calm += 1
            return None
        if not self._planned:
            self._plan, self._planned = self._plan_of(rests, goals), True
        return self._plan.legs(places) if self._plan is not None else None

    def _plan_of(self, rests: Complexes, goals: Complexes) -> _Plan | None:
        """Return the ways in an order that leads from places of rest to goals (m), if one is found."""
        off_m = np.abs(rests[:, None] - goals)
        rests = np.where(off_m.min(axis=1) <= _AT_M, goals[off_m.argmin(axis=1)], rests)
        asked = list(dict.fromkeys([*goals.tolist(), *rests.tolist()]))
        ends, starts = ([asked.index(place) for place in places.tolist()] for places in (goals, rests))
        if len(set(ends)) < len(ends) or len(self._geodesics.rows) > _MOST_NODES:
            return None
        roadmap = move_map_of(self._geodesics, np.array(asked), self._apart_m)
        moves = MoveOrder(roadmap, ends).find(starts)
        return None if moves is None else _Plan(roadmap, starts, moves, self._geodesics, self._apart_m)


class _Plan:
    """Order of moves, and how many of its own each robot has made."""

    def __init__(
        self, roadmap: MoveMap, starts: Sequence[int], moves: Sequence[Move], geodesics: Geodesics, apart_m: float
    ) -> None:
        self._roadmap, self._geodesics = roadmap, geodesics
        self._stands = list(starts)
        self._own: list[list[int]] = [[] for _ in starts]
        self._needs: list[list[dict[int, int]]] = [[] for _ in starts]
        for move, needs in zip(moves, _needs(moves, roadmap, apart_m + CLEARER_M), strict=True):
            self._own[move.robot].append(move.move)
            self._needs[move.robot].append(needs)
        self._made = [0] * len(starts)

    def legs(self, places: Complexes) -> list[NextLeg]:
        """Return the next part of each robot's way from its place (m)."""
        for robot, place in enumerate(places.tolist()):
            while self._may(robot, self._made[robot]) and self._is_made(robot, place):
                self._stands[robot] = int(self._roadmap.ends[self._own[robot][self._made[robot]]])
                self._made[robot] += 1
        return [self._leg(robot, place) for robot, place in enumerate(places.tolist())]

    def _may(self, robot: int, number: int) -> bool:
        """Return whether a robot has a move of its own with this number, and may make it."""
        own = self._own[robot]
        return number < len(own) and all(self._made[other] >= n for other, n in self._needs[robot][number].items())

    def _is_made(self, robot: int, place: complex) -> bool:
        """Return whether a robot at a place has made its next move."""
        import shapely

        move = self._own[robot][self._made[robot]]
        line, end, here = self._roadmap.lines[move], self._roadmap.ends[move], shapely.Point(place.real, place.imag)
        passed = line.length - line.project(here) <= _DONE_M and line.distance(here) <= _BESIDE_M
        return bool(passed or abs(self._roadmap.places[end] - place) <= _DONE_M)

    def _leg(self, robot: int, place: complex) -> NextLeg:
        made, own = self._made[robot], self._own[robot]
        left_m = float(self._roadmap.lengths_m[own[made:]].sum())
        until = made
        while self._may(robot, until):
            until += 1
        if until == made:
            stands = complex(self._roadmap.places[self._stands[robot]])
            return NextLeg(stands, left_m + abs(stands - place), Manner.EXACT)
        end, length_m = self._roadmap.places[self._roadmap.ends[own[made]]], self._roadmap.lengths_m[own[made]]
        return NextLeg(self._aim(place, own[made:until]), left_m - float(length_m - abs(end - place)), Manner.EXACT)

    def _aim(self, place: complex, moves: Sequence[int]) -> complex:
        """Return the farthest point of a way to which a robot may drive straight, without getting far off the way."""
        import shapely

        lines = [self._roadmap.lines[move] for move in moves]
        line = line_of(np.concatenate([points_of(each) for each in lines]))
        at_m = float(lines[0].project(shapely.Point(place.real, place.imag)))
        until_m = min(line.length, at_m + _SIGHT_M)
        steps_m = np.append(np.arange(at_m + _STEP_M, until_m, _STEP_M), until_m)
        ahead = points_of(line.interpolate(steps_m))
        aim = complex(points_of(line.interpolate(at_m + _RETURN_M))[0])
        for number, point in enumerate(ahead.tolist()):
            short_cut = _off_m(ahead[:number], place, point) > _OFF_M
            returns = number > 0 and abs(point - place) < np.abs(ahead[:number] - place).max()
            if short_cut or returns or not self._geodesics.clear(place, point):
                break
            aim = point
        return aim


def _off_m(points: Complexes, place: complex, other: complex) -> float:
    """Return the largest distance of points from the straight way between two places (m)."""
    way = other - place
    turned = (points - place) * (way.conjugate() / max(abs(way), _SAME_M))
    off: Complexes = turned - np.clip(turned.real, 0.0, abs(way))
    return float(np.abs(off).max(initial=0.0))


def _needs(moves: Sequence[Move], roadmap: MoveMap, near_m: float) -> list[dict[int, int]]:
    """Return what has to happen before each move of an order: how many of their own other robots must have made."""
    import shapely

    lines = np.array([roadmap.lines[move.move] for move in moves], dtype=np.object_)
    counts, numbers, found = Counter[int](), list[int](), [dict[int, int]() for _ in moves]
    for move in moves:
        counts[move.robot] += 1
        numbers.append(counts[move.robot])
    after, before = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=near_m)
    for late, early in zip(after.tolist(), before.tolist(), strict=True):
        other = moves[early].robot
        if early < late and other != moves[late].robot:
            found[late][other] = max(found[late].get(other, 0), numbers[early])
    return found
