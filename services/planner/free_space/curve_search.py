"""Search for ways of vehicles that cannot turn on the spot: straights and CC turns, forward and backward.

Hybrid A* (Dolgov, Thrun, Montemerlo and Diebel, "Path planning for autonomous vehicles in unknown semi-structured
environments", International Journal of Robotics Research 29(5), 2010) whose steps begin and end straight, so that any
two join with continuous curvature. Now and then the goal is tried directly, by the planner's transitions.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterator
from itertools import count
from typing import Final, NamedTuple

from touchline.services.planner.free_space.legs import WalledBody
from touchline.services.planner.free_space.rounded_legs import path_is_free
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath, joined
from touchline.services.planner.poses.traveller import Traveller
from touchline.services.planner.steering.turns import ContinuousTurn

# States that count as one: squares (m, relative to the smallest turn) and sectors of heading.
SQUARE_SHARE: Final = 0.2
SECTORS: Final = 36
DEFLECTIONS_RAD: Final = tuple(math.radians(angle) for angle in (15.0, 45.0, 90.0))
STATES_MAX: Final = 12_000
"""States after which the search gives up."""
# The goal is tried directly from every state that is as near as this (in smallest turns), and from every so many.
NEAR_TURNS, EVERY = 3.0, 40
# Costs of a change of direction, and of driving backward, as lengths (m) and per metre.
CUSP_M, BACKWARD = 1.0, 1.2

Connect = Callable[[PathPose, PathPose], list[PiecePath]]


class _State(NamedTuple):
    """A pose that was reached: the state before it and the pieces from there, the direction, the cost (m)."""

    pose: PathPose
    before: _State | None
    pieces: tuple[Piece, ...]
    direction: int
    cost_m: float


def curve_way(
    start: PathPose, goal: PathPose, traveller: Traveller, body: WalledBody, connect: Connect
) -> PiecePath | None:
    """Find a way that a vehicle can drive without turning on the spot; None if none was found.

    Args:
        start: Start pose.
        goal: Goal pose, with a heading.
        traveller: The vehicle.
        body: Its body among walls.
        connect: Makes paths between two poses in open ground, the quickest first.
    """
    curvature, sharpness = traveller.limits.turn_at(0.3 * traveller.limits.transit_speed_mps)
    turn = ContinuousTurn(curvature, sharpness)
    steps, square_m = list(_steps(turn, traveller.can_reverse)), SQUARE_SHARE * turn.radius
    number = count()
    first = _State(start, None, (), 0, 0.0)
    queue = [(abs(goal.point - start.point), next(number), first)]
    done: set[tuple[int, int, int]] = set()
    while queue and len(done) < STATES_MAX:
        _, _, state = heapq.heappop(queue)
        key = _key(state.pose, square_m)
        if key in done:
            continue
        done.add(key)
        if len(done) % EVERY == 1 or abs(goal.point - state.pose.point) < NEAR_TURNS * turn.radius:
            for path in connect(state.pose, goal):
                if path_is_free(path, body):
                    return _shortened(_traced(state, path), body, connect)
        for pieces, length_m in steps:
            path = PiecePath(state.pose, pieces)
            if _key(path.end, square_m) in done or not path_is_free(path, body):
                continue
            direction = pieces[0].direction
            cost_m = state.cost_m + length_m * (1.0 if direction > 0 else BACKWARD)
            cost_m += CUSP_M if state.direction == -direction else 0.0
            following = _State(path.end, state, pieces, direction, cost_m)
            heapq.heappush(queue, (cost_m + abs(goal.point - path.end.point), next(number), following))
    return None


def _steps(turn: ContinuousTurn, can_reverse: bool) -> Iterator[tuple[tuple[Piece, ...], float]]:
    """Pieces of all steps, and their lengths (m)."""
    left = [turn.pieces(angle) for angle in DEFLECTIONS_RAD]
    right = [tuple(piece.mirrored() for piece in pieces) for pieces in left]
    straight = (Piece(0.5 * turn.radius),)
    for direction in (1, -1) if can_reverse else (1,):
        for pieces in (straight, *left, *right):
            driven = tuple(piece._replace(direction=direction) for piece in pieces)
            yield driven, sum(piece.length_m for piece in pieces)


def _key(pose: PathPose, square_m: float) -> tuple[int, int, int]:
    sector = round(pose.heading_rad / math.tau * SECTORS) % SECTORS
    return math.floor(pose.x_m / square_m), math.floor(pose.y_m / square_m), sector


def _traced(state: _State, last: PiecePath) -> list[PiecePath]:
    """Parts of the way from its start."""
    parts = [last]
    while state.before is not None:
        parts.append(PiecePath(state.before.pose, state.pieces))
        state = state.before
    return parts[::-1]


def _shortened(parts: list[PiecePath], body: WalledBody, connect: Connect) -> PiecePath:
    """Join parts, with direct paths between as many of their ends as are free and shorter."""
    k = 0
    while k < len(parts) - 1:
        for j in range(len(parts) - 1, k, -1):
            length_m = sum(part.length_m for part in parts[k : j + 1])
            paths = connect(parts[k].start, parts[j].end)
            better = [path for path in paths if path.length_m < length_m and path_is_free(path, body)]
            if better:
                parts[k : j + 1] = [min(better, key=lambda path: path.length_m)]
                break
        k += 1
    return PiecePath(parts[0].start, joined(piece for part in parts for piece in part.pieces))
