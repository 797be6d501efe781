"""Detours: where every direct transition collides, one after backing out, or two over a pose in between."""

import math
from collections.abc import Iterator

import numpy as np

from touchline.services.planner.collision.checker import CollisionChecker
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
BACKED_M = tuple(sorted(((a, b) for a in (0.0, 1.0, 2.5, 5.0) for b in (0.0, 1.0, 2.5, 5.0)), key=sum))[1:]
# Number of via poses that are tried, the quickest detour first.
TRIED = 150
# Number of clear detours that are offered.
OFFERED = 4
# An end from or to which this many transitions collide, without exception, is closed in.
MANY = 30


def detours(
    start: CurveEnd,
    goal: CurveEnd,
    transitions: TransitionFamily,
    checker: CollisionChecker,
    closed: set[tuple[str, CurveEnd]],
) -> Iterator[Transition]:
    """Collision-free transitions with backing, then over one via pose, the quickest first by the method's rough times.

    If there is none, the cause is mostly the same for every partner of an end: no room to stop or to start there.

    Args:
        start: End of the last painted curve.
        goal: Beginning of the next one.
        transitions: Transitions of the method in use.
        checker: Checker of boundary and obstacles.
        closed: Ends known to be closed in; more are added.
    """
    leaving, reaching = ("from", start), ("to", goal)
    if leaving in closed or reaching in closed:
        return
    backed_s = math.inf
    for transition in _backing(start, goal, transitions, checker):
        backed_s = min(backed_s, transition.seconds)
        yield transition
    via = [CurveEnd(PathPose(*pose), 0.0) for pose in _poses(start, goal, checker).tolist()]
    price = pricing_of(transitions).rough_s
    around_s = price(transitions, [start], via)[0] + price(transitions, via, [goal])[:, 0]
    offered = tried = departed = 0
    most = MANY if math.isfinite(backed_s) else TRIED
    for k in np.argsort(around_s, kind="stable")[:most].tolist():
        if around_s[k] >= backed_s:
            return
        middle = via[k]
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
        closed.add(leaving)
    elif not offered and departed >= MANY:
        closed.add(reaching)


def _backing(
    start: CurveEnd, goal: CurveEnd, transitions: TransitionFamily, checker: CollisionChecker
) -> Iterator[Transition]:
    """Collision-free transitions that back along the painted curves, the shortest ways back first.

    The robot stops straight behind the last curve and backs along it, or drives to a pose on the next curve and backs
    along that to where it gathers speed.
    """
    if REVERSING not in transitions.standing:
        return
    speeds = [transitions.speed_mps(end) for end in (start, goal)]
    rooms_m = [transitions.room_m((speed, 0.0)) for speed in speeds]
    offered = 0
    for out_m, in_m in BACKED_M:
        leaving, reaching = (
            CurveEnd(end.pose.moved(arc_displacement(by_m, end.curvature_1pm), by_m * end.curvature_1pm), 0.0, 0.0)
            if by_m
            else end
            for end, by_m in ((start, -out_m), (goal, in_m))
        )
        out = _to_and_fro(rooms_m[0], out_m, start.curvature_1pm) if out_m else ()
        into = _to_and_fro(rooms_m[1], in_m, goal.curvature_1pm)[::-1] if in_m else ()
        for between in transitions.between(leaving, reaching):
            path = PiecePath(start.pose, joined((*out, *between.path.pieces, *into)))
            if checker.is_clear(path):
                yield Transition(transitions.seconds(path.pieces, *speeds), path)
                offered += 1
                break
        if offered == OFFERED:
            return


def _to_and_fro(ahead_m: float, back_m: float, curvature_1pm: float) -> tuple[Piece, Piece]:
    """Pieces ahead to a standstill, and back past their beginning."""
    return Piece(ahead_m, curvature_1pm), Piece(ahead_m + back_m, curvature_1pm, direction=-1)


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
