"""The order in which lanes are driven, and which way."""

import math

import numpy as np

from touchline.services.planner.coverage.cover_stroke import CoverStroke
from touchline.services.planner.coverage.kernels.lane_anneal import annealed, price
from touchline.services.planner.coverage.kernels.survey import Mover
from touchline.services.planner.coverage.lanes import Lane
from touchline.services.planner.coverage.machine import CoverageMachine
from touchline.services.planner.geometry.clothoid import Floats, Ints, PathPose
from touchline.services.planner.steering.circles import shortest_word
from touchline.services.planner.steering.turns import ContinuousTurn

# Steps of the search for each lane, within bounds; its first temperature (s) and how often it is begun anew.
STEPS_PER_LANE, STEPS_MOST, HOT_S, STARTS = 6000, 400_000, 20.0, 3
# Ends of neighbours this close (m) along the lanes are beside each other.
BESIDE_M = 3.0
# What two neighbours leave between them where they turn apart (m²), about.
SLIVER_M2 = 0.9


def turn_room_m(machine: CoverageMachine) -> float:
    """How far ahead of its tool the machine's body gets in a half turn."""
    turn = ContinuousTurn(machine.curvature_max_1pm, machine.sharpness_max_1pm2)
    from touchline.services.planner.geometry.clothoid import PiecePath

    path = PiecePath(PathPose(0.0, 0.0, 0.0), turn.pieces(math.pi))
    x, _, heading, _ = path.sample(np.linspace(0.0, path.length_m, 200))
    corners = np.array(machine.outline)
    return float(max((x + np.cos(heading) * cx - np.sin(heading) * cy).max() for cx, cy in corners.tolist()))


def ordered_lanes(
    items: list[Lane], before: list[CoverStroke], angle_rad: float, mover: Mover, room_m: float, seconds_per_m2: float
) -> Ints:
    """The order of lanes as nodes: lane k along is 2k, back 2k + 1; one of `before` comes before them."""
    if len(items) < 2:
        return np.arange(0, 2 * len(items), 2)
    strokes = [stroke for lane in items for stroke in (lane.along, lane.back)]
    cost = _costs(strokes, mover, room_m)
    for k in range(0, len(strokes), 2):
        cost[k : k + 2, k : k + 2] = 1e6
    entry = np.array([min((way_s(b, stroke, mover, room_m) for b in before), default=0.0) for stroke in strokes])
    across = complex(-math.sin(angle_rad), math.cos(angle_rad))
    level = np.array([(lane.along.start.point * across.conjugate()).real for lane in items])
    pairs, apart_s = _neighbours(items, angle_rad), seconds_per_m2 * SLIVER_M2
    steps = min(STEPS_PER_LANE * len(items), STEPS_MOST)
    turned = np.zeros((len(items), 2), np.int64)
    start = np.array([2 * k + k % 2 for k in range(len(items))])
    offers = [annealed(start, cost, level, entry, pairs, apart_s, steps, HOT_S, seed) for seed in range(STARTS)]
    return min(offers, key=lambda order: float(price(order, cost, level, entry, pairs, apart_s, turned)))


def _costs(strokes: list[CoverStroke], mover: Mover, room_m: float) -> Floats:
    """Seconds from where each is left for a turn to where another is joined."""
    return np.array([[way_s(first, last, mover, room_m) for last in strokes] for first in strokes])


def way_s(first: CoverStroke, last: CoverStroke, mover: Mover, room_m: float) -> float:
    """Seconds from one stroke to the next if both leave room for a turn, whatever is in the way."""
    leave = first.length_m - min(room_m, 0.5 * first.length_m)
    return word_s(first.at(leave), last.at(min(room_m, 0.5 * last.length_m)), mover)


def word_s(start: PathPose, goal: PathPose, mover: Mover) -> float:
    """Seconds for the shortest word between two poses, whatever is in its way."""
    z, turn = goal.seen_from(start)
    facing = complex(math.cos(turn), math.sin(turn))
    length = shortest_word(z * mover.root, facing, turn, mover.circle, 1.0)
    return float(length) / mover.root / mover.speed_mps


def _neighbours(items: list[Lane], angle_rad: float) -> Ints:
    """(p, 3) lane, its upper neighbour, and the end at which they lie beside each other."""
    along = complex(math.cos(angle_rad), math.sin(angle_rad))
    ends = [
        ((lane.back.at(lane.back.length_m).point / along), (lane.along.at(lane.along.length_m).point / along))
        for lane in items
    ]
    found = [
        (i, j, side)
        for i, lane in enumerate(items)
        for j, other in enumerate(items)
        if other.row == lane.row + 1
        for side in range(2)
        if abs(ends[i][side].real - ends[j][side].real) < BESIDE_M
    ]
    return np.array(found, dtype=np.int64).reshape(-1, 3)
