"""Detours: where every direct transition collides, one after backing out, or two over a pose in between."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import product
from typing import NamedTuple, TypeAlias

import numpy as np

from touchline.services.planner.collision.checker import CollisionChecker
from touchline.services.planner.collision.ways_round import WaysRound
from touchline.services.planner.geometry.clothoid import (
    Floats,
    PathPose,
    Piece,
    PiecePath,
    arc_displacement,
    joined,
)
from touchline.services.planner.steering.method import CurveEnd
from touchline.services.planner.transitions.pricing import pricing_of
from touchline.services.planner.transitions.transitions import REVERSING, Transition, TransitionFamily

# Via poses: a grid over the neighbourhood of both ends, and points beside the outlines' corners, in several headings.
GRID, ROOM_M, HEADINGS = 7, 6.0, 8
# Distances (m) by which the robot backs along the painted curves: out of the last one, and into the next one.
BACK_M = 0.0, 1.0, 2.5, 5.0
BACKED_M = tuple(sorted(product(BACK_M, BACK_M), key=sum))[1:]
FAR_BACKED_M = 2.5, 2.5
# Number of via poses that are tried, the quickest detour first.
TRIED = 150
# The same for a robot that stands where its map has no way out, but by a curve there may be one.
TRIED_SHUT_IN = 50
# Number of clear detours that are offered.
OFFERED = 4
# An end from or to which this many transitions collide, without exception, is closed in.
MANY = 30


class DetourBounds(NamedTuple):
    """Bounds of a search over via poses: the time of a detour that is known (s), and the number of poses."""

    least_s: float = math.inf
    most: int = TRIED


@dataclass(frozen=True)
class ClosedEnds:
    """Ends that have proved closed in: the cause is the same for every partner, no room to stop or to start there.

    Attributes:
        to_leave, to_reach: Ends from which, or to which, no transition over a via pose leads.
        for_good: Those of both kinds of which that holds after backing, too: they have no detour.
    """

    to_leave: set[CurveEnd] = field(default_factory=set)
    to_reach: set[CurveEnd] = field(default_factory=set)
    for_good: tuple[set[CurveEnd], set[CurveEnd]] = field(default_factory=lambda: (set(), set()))

    def between(self, start: CurveEnd, goal: CurveEnd) -> bool:
        """Return whether nothing leads over a via pose from a start to a goal."""
        return start in self.to_leave or goal in self.to_reach

    def learn(self, start: CurveEnd, goal: CurveEnd, backing: "_Backings", ways: WaysRound | None) -> None:
        """Note ends between which there is no detour; each by how it can itself be backed, not by its partner.

        A standing start on the map is not closed: the map may have a way to another goal, as straight on, where no via
        pose lies.
        """
        out, into = backing.get((FAR_BACKED_M[0], 0.0)), backing.get((0.0, FAR_BACKED_M[1]))
        on_map = ways is not None and start.speed_mps == 0.0 and ways.leaves(start)
        if start in self.to_leave and not on_map and (out is None or out.leaving in self.to_leave):
            self.for_good[0].add(start)
        if goal in self.to_reach and (into is None or into.reaching in self.to_reach):
            self.for_good[1].add(goal)


def detours(
    start: CurveEnd,
    goal: CurveEnd,
    transitions: TransitionFamily,
    checker: CollisionChecker,
    closed: ClosedEnds,
    ways: WaysRound | None = None,
) -> Iterator[Transition]:
    """Collision-free transitions with backing, then over a via pose, the quickest first by the method's rough times.

    A robot that turns on the spot looks at its map of the ground first: if that has no way, there is none over a via
    pose either, but for few exceptions, and it takes long to find out; if it has one, that comes last.

    Args:
        start: End of the last painted curve.
        goal: Beginning of the next one.
        transitions: Transitions of the method in use.
        checker: Checker of boundary and obstacles.
        closed: Ends known to be closed in; more are added.
        ways: Ways round the outlines, if the robot turns on the spot.
    """
    if start in closed.for_good[0] or goal in closed.for_good[1]:
        return
    offered, least_s = 0, math.inf
    backing = _backings(start, goal, transitions, checker) if REVERSING in transitions.standing else {}
    for backed in map(backing.get, BACKED_M):
        if backed is None:
            continue
        between = transitions.between(backed.leaving, backed.reaching)
        transition = next((each for each in map(backed.whole, between) if checker.is_clear(each.path)), None)
        if transition is not None:
            offered, least_s = offered + 1, min(least_s, transition.seconds)
            yield transition
            if offered == OFFERED:
                break
    way: Transition | None = None
    most, far = TRIED, backing.get(FAR_BACKED_M)
    if ways is not None and not offered and ways.knows(start, goal):
        way = ways.between(start, goal)
        if way is not None:
            least_s = way.seconds
        elif start.speed_mps > 0.0:
            return
        else:
            far, most = None, TRIED_SHUT_IN
    bounds = DetourBounds(least_s, MANY if math.isfinite(least_s) else most)
    for transition in _around(start, goal, transitions, checker, closed, bounds):
        offered += 1
        yield transition
    if way is not None:
        offered += 1
        yield way
    if far is not None and not offered:
        for transition in _around(far.leaving, far.reaching, transitions, checker, closed, DetourBounds()):
            offered += 1
            yield far.whole(transition)
    if not offered:
        closed.learn(start, goal, backing, ways)


@dataclass(frozen=True)
class _Backed:
    """Transition that begins and ends with backing along the painted curves.

    The robot stops straight behind the last curve and backs along it, or drives to a pose on the next curve and backs
    along that to where it gathers speed.

    Attributes:
        start, goal: Ends of the painted curves.
        out, into: Pieces from the start, and to the goal.
        leaving, reaching: Ends between which the robot has yet to find its way.
        transitions: Transitions of the method in use.
    """

    start: CurveEnd
    goal: CurveEnd
    out: tuple[Piece, ...]
    into: tuple[Piece, ...]
    leaving: CurveEnd
    reaching: CurveEnd
    transitions: TransitionFamily

    def whole(self, between: Transition) -> Transition:
        """Return the transition from start to goal with this one in the middle."""
        pieces = joined((*self.out, *between.path.pieces, *self.into))
        speeds = (self.transitions.speed_mps(end) for end in (self.start, self.goal))
        return Transition(self.transitions.seconds(pieces, *speeds), PiecePath(self.start.pose, pieces))


_Backings: TypeAlias = dict[tuple[float, float], _Backed]


def _backings(start: CurveEnd, goal: CurveEnd, transitions: TransitionFamily, checker: CollisionChecker) -> _Backings:
    """Clear ways of backing out of the first curve and into the second, by their distances; 0: not at all."""
    outs: dict[float, tuple[CurveEnd, tuple[Piece, ...]]] = {0.0: (start, ())}
    intos: dict[float, tuple[CurveEnd, tuple[Piece, ...]]] = {0.0: (goal, ())}
    for back_m in BACK_M[1:]:
        leaving, out = _backed_off(start, -back_m, transitions)
        if checker.is_clear(PiecePath(start.pose, out)):
            outs[back_m] = leaving, out
        reaching, into = _backed_off(goal, back_m, transitions)
        if checker.is_clear(PiecePath(reaching.pose, into[::-1])):
            intos[back_m] = reaching, into[::-1]
    return {
        (out_m, in_m): _Backed(start, goal, out, into, leaving, reaching, transitions)
        for out_m, (leaving, out) in outs.items()
        for in_m, (reaching, into) in intos.items()
    }


def _backed_off(end: CurveEnd, by_m: float, transitions: TransitionFamily) -> tuple[CurveEnd, tuple[Piece, Piece]]:
    """Standstill on a curve `by_m` beyond its end, and the pieces between: to a standstill on the other side, and back.

    They lead from the end to the standstill; in reverse order they lead from there to the end.
    """
    room_m, bend = transitions.room_m((transitions.speed_mps(end),)), end.curvature_1pm
    pose = end.pose.moved(arc_displacement(by_m, bend), by_m * bend)
    return CurveEnd(pose, 0.0, 0.0), (Piece(room_m, bend), Piece(room_m + abs(by_m), bend, direction=-1))


def _around(
    start: CurveEnd,
    goal: CurveEnd,
    transitions: TransitionFamily,
    checker: CollisionChecker,
    closed: ClosedEnds,
    bounds: DetourBounds,
) -> Iterator[Transition]:
    """Collision-free transitions over one via pose, within bounds; see `detours`."""
    if closed.between(start, goal):
        return
    via = [CurveEnd(PathPose(*pose), 0.0) for pose in _poses(start, goal, checker).tolist()]
    price = pricing_of(transitions).rough_s
    around_s = price(transitions, [start], via)[0] + price(transitions, via, [goal])[:, 0]
    offered = tried = departed = 0
    for k in np.argsort(around_s, kind="stable")[: bounds.most].tolist():
        middle = via[k]
        if around_s[k] >= bounds.least_s:
            return
        if checker.touches([middle.pose]):  # as every path there would
            continue
        tried += 1
        there = next((w for w in transitions.between(start, middle) if checker.is_clear(w.path)), None)
        if there is None:
            continue
        departed += 1
        on = next((w for w in transitions.between(middle, goal) if checker.is_clear(w.path)), None)
        if on is not None:
            pieces = (*there.path.pieces, *on.path.pieces)
            speeds = (transitions.speed_mps(end) for end in (start, goal))
            yield Transition(transitions.seconds(pieces, *speeds), PiecePath(start.pose, pieces))
            offered += 1
            if offered == OFFERED:
                return
    if not departed and tried >= MANY:
        closed.to_leave.add(start)
    elif not offered and departed >= MANY:
        closed.to_reach.add(goal)


def _poses(start: CurveEnd, goal: CurveEnd, checker: CollisionChecker) -> Floats:
    """Candidates (n, 3) for the via pose: x (m), y (m), heading (rad)."""
    points = np.array([start.pose[:2], goal.pose[:2]])
    low, high = points.min(axis=0) - ROOM_M, points.max(axis=0) + ROOM_M
    grid = np.stack(np.meshgrid(*(np.linspace(a, b, GRID) for a, b in zip(low, high, strict=True))), -1).reshape(-1, 2)
    corners = checker.edges[:, :2]
    near = corners[np.all((corners > low - ROOM_M) & (corners < high + ROOM_M), axis=1)]
    angles = np.arange(4) * math.pi / 2.0 + math.pi / 4.0
    beside = near[:, None] + 1.6 * checker.reach_m * np.stack((np.cos(angles), np.sin(angles)), -1)
    places = np.concatenate((grid, beside.reshape(-1, 2)))
    headings = np.arange(HEADINGS) * math.tau / HEADINGS
    return np.column_stack((np.repeat(places, HEADINGS, axis=0), np.tile(headings, len(places))))
