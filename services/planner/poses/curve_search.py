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

import numpy as np
import shapely

from touchline.core.robust_overlay import buffer
from touchline.services.planner.free_space.body_sweeps import cheapest
from touchline.services.planner.free_space.legs import WalledBody
from touchline.services.planner.free_space.rounded_legs import STEP_M, arc_slack_m, path_is_free
from touchline.services.planner.geometry.clothoid import Floats, PathPose, Piece, PiecePath, joined
from touchline.services.planner.poses.traveller import Traveller
from touchline.services.planner.steering.turns import ContinuousTurn

# States that count as one: squares (m, relative to the smallest turn) and sectors of heading.
SQUARE_SHARE: Final = 0.2
SECTORS: Final = 36
DEFLECTIONS_RAD: Final = tuple(math.radians(angle) for angle in (15.0, 45.0, 90.0))
STATES_MAX: Final = 8_000
"""States after which the search gives up."""
# Near the goal (in smallest turns) it is tried directly from one in so many states, elsewhere from fewer.
NEAR_TURNS, EVERY_NEAR, EVERY = 3.0, 6, 40
# Spacing of the grid for distances (m), and most of its points.
SPACING_M, POINTS_MAX = 0.4, 4000
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
    number, to_go_m = count(), DistanceGrid(body, goal)
    first = _State(start, None, (), 0, 0.0)
    queue = [(to_go_m.at(start), next(number), first)]
    done: set[tuple[int, int, int]] = set()
    while queue and len(done) < STATES_MAX:
        _, _, state = heapq.heappop(queue)
        key = _key(state.pose, square_m)
        if key in done:
            continue
        done.add(key)
        near = abs(goal.point - state.pose.point) < NEAR_TURNS * turn.radius
        if len(done) % (EVERY_NEAR if near else EVERY) == 1:
            for path in connect(state.pose, goal):
                if path_is_free(path, body):
                    return _shortened(_traced(state, path), body, connect)
        for step in steps:
            poses = step.poses_from(state.pose)
            end = PathPose(*poses[-1].tolist())
            if _key(end, square_m) in done or not body.sweeps(poses, step.slack_m(body)):
                continue
            direction = step.pieces[0].direction
            cost_m = state.cost_m + step.length_m * (1.0 if direction > 0 else BACKWARD)
            cost_m += CUSP_M if state.direction == -direction else 0.0
            following = _State(end, state, step.pieces, direction, cost_m)
            heapq.heappush(queue, (cost_m + to_go_m.at(end), next(number), following))
    return None


class _Step(NamedTuple):
    """A straight or a turn: its pieces, its length (m), and (n, 3) poses along it, from the origin."""

    pieces: tuple[Piece, ...]
    length_m: float
    poses: Floats

    def poses_from(self, pose: PathPose) -> Floats:
        """Poses (n, 3) along it from a pose."""
        cos, sin = math.cos(pose.heading_rad), math.sin(pose.heading_rad)
        x, y, heading = self.poses.T
        return np.column_stack((pose.x_m + cos * x - sin * y, pose.y_m + sin * x + cos * y, pose.heading_rad + heading))

    def slack_m(self, body: WalledBody) -> float:
        """Growth of the body that covers the bends between the poses."""
        return arc_slack_m(max(abs(piece.curvature_1pm) for piece in self.pieces), body)


class DistanceGrid:
    """Lengths of ways of a disc that fits into the body to a goal, on a grid."""

    def __init__(self, body: WalledBody, goal: PathPose) -> None:
        """Search from the goal to every point of the grid."""
        left, low, right, high = body.ground.free.bounds
        self._spacing_m = spacing = max(SPACING_M, math.sqrt((right - left) * (high - low) / POINTS_MAX))
        self._low = np.array((left, low))
        shape = tuple(int(size / spacing) + 1 for size in (right - left, high - low))
        places = self._low + spacing * np.argwhere(np.ones(shape))
        room = buffer(body.ground.free, -float(min(body.corners[:, 1].max(), -body.corners[:, 1].min())))
        shapely.prepare(room)
        free = shapely.contains_xy(room, places).reshape(shape)
        number = np.arange(free.size).reshape(shape)
        pairs = []
        for dx, dy in ((1, 0), (0, 1), (1, 1), (1, -1)):
            a = number[: shape[0] - dx, max(-dy, 0) : shape[1] - max(dy, 0)].ravel()
            b = number[dx:, max(dy, 0) : shape[1] + min(dy, 0)].ravel()
            both = free.ravel()[a] & free.ravel()[b]
            pairs.append(np.column_stack((a[both], b[both], np.full(both.sum(), spacing * math.hypot(dx, dy)))))
        edges = np.concatenate(pairs)
        edges = np.concatenate((edges, edges[:, (1, 0, 2)]))
        edges = edges[np.argsort(edges[:, 0], kind="stable")]
        first = np.hypot(*(places - (goal.x_m, goal.y_m)).T)
        first[first > 2.0 * spacing] = np.inf
        offsets = np.searchsorted(edges[:, 0], np.arange(free.size + 1))
        costs, _ = cheapest(first, offsets, edges[:, 1].astype(np.int64), np.ascontiguousarray(edges[:, 2]))
        self._costs, self._goal = costs.reshape(shape), goal

    def at(self, pose: PathPose) -> float:
        """Length (m) from a pose; in places where the disc has no room, that of the nearest grid point or straight."""
        i, j = np.rint((np.array(pose[:2]) - self._low) / self._spacing_m).astype(int)
        i, j = (min(max(k, 0), size - 1) for k, size in zip((i, j), self._costs.shape, strict=True))
        found = float(self._costs[i, j])
        return found if math.isfinite(found) else 2.0 * abs(self._goal.point - pose.point)


def _steps(turn: ContinuousTurn, can_reverse: bool) -> Iterator[_Step]:
    left = [turn.pieces(angle) for angle in DEFLECTIONS_RAD]
    right = [tuple(piece.mirrored() for piece in pieces) for pieces in left]
    straight = (Piece(0.5 * turn.radius),)
    for direction in (1, -1) if can_reverse else (1,):
        for pieces in (straight, *left, *right):
            driven = tuple(piece._replace(direction=direction) for piece in pieces)
            path = PiecePath(PathPose(0.0, 0.0, 0.0), driven)
            along = np.linspace(0.0, path.length_m, 1 + math.ceil(path.length_m / STEP_M))
            yield _Step(driven, path.length_m, np.column_stack(path.sample(along)[:3]))


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
