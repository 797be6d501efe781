"""Via poses: where every direct transition collides, two transitions over a pose in between."""

import math
from collections.abc import Iterator

import numpy as np

from touchline.services.planner.collision.checker import CollisionChecker
from touchline.services.planner.geometry.clothoid import Floats, PathPose, PiecePath
from touchline.services.planner.steering.method import CurveEnd
from touchline.services.planner.transitions.pricing import pricing_of
from touchline.services.planner.transitions.transitions import Transition, TransitionFamily

# Poses in between: a grid over the neighbourhood of both ends and beside the outlines' corners, in so many headings.
GRID, ROOM_M, HEADINGS = 7, 6.0, 8
# So many of them are tried, the quickest detour first.
TRIED = 150
# Of those found clear so many are offered.
OFFERED = 4
# An end from which, or to which, so many ways collide, and none does not, is closed in.
MANY = 30


def detours(
    start: CurveEnd,
    goal: CurveEnd,
    transitions: TransitionFamily,
    checker: CollisionChecker,
    closed: set[tuple[str, CurveEnd]],
) -> Iterator[Transition]:
    """Collision-free transitions over one via pose, the quickest first by the method's rough times.

    None has mostly the same cause for every partner of an end: there is no room to stop, or to set off.

    Args:
        start: Where the last painted curve ends.
        goal: Where the next one begins.
        transitions: The transitions of the method in use.
        checker: The outlines.
        closed: Ends that are known to be closed in; more are added.
    """
    leaving, reaching = ("from", start), ("to", goal)
    if leaving in closed or reaching in closed:
        return
    via = [CurveEnd(PathPose(*pose), 0.0) for pose in _poses(start, goal, checker).tolist()]
    price = pricing_of(transitions).rough_s
    around_s = price(transitions, [start], via)[0] + price(transitions, via, [goal])[:, 0]
    offered = tried = left = 0
    for k in np.argsort(around_s, kind="stable")[:TRIED].tolist():
        middle = via[k]
        if checker.touches([middle.pose]):  # as every way there would
            continue
        tried += 1
        there = next((w for w in transitions.between(start, middle) if checker.is_clear(w.path)), None)
        if there is None:
            continue
        left += 1
        on = next((w for w in transitions.between(middle, goal) if checker.is_clear(w.path)), None)
        if on is not None:
            pieces = (*there.path.pieces, *on.path.pieces)
            speeds = (transitions.speed_mps(end) for end in (start, goal))
            yield Transition(transitions.seconds(pieces, *speeds), PiecePath(start.pose, pieces))
            offered += 1
            if offered == OFFERED:
                return
    if not left and tried >= MANY:
        closed.add(leaving)
    elif not offered and left >= MANY:
        closed.add(reaching)


def _poses(start: CurveEnd, goal: CurveEnd, checker: CollisionChecker) -> Floats:
    """(n, 3) candidates for the via pose: x (m), y (m), heading (rad)."""
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
