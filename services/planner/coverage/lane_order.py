"""Order and directions in which lanes are driven, by simulated annealing."""

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from touchline.services.planner.coverage.cover_stroke import CoverStroke
from touchline.services.planner.coverage.coverage_machine import CoverageMachine
from touchline.services.planner.coverage.kernels.lane_anneal import LaneCosts, annealed
from touchline.services.planner.coverage.kernels.turn_pieces import spun_between, spun_s, words_s
from touchline.services.planner.coverage.lanes import CoverLane
from touchline.services.planner.coverage.stroke_transition import TransitionFinder
from touchline.services.planner.geometry.clothoid import Floats, Ints, PathPose, PiecePath
from touchline.services.planner.steering.turns import ContinuousTurn
from touchline.services.planner.steering.words import shortest_word

# Steps of the search per lane and at most, its initial temperature (s), and the number of restarts.
STEPS_PER_LANE, STEPS_MOST, HOT_S, STARTS = 3000, 200_000, 20.0, 12
# Price of what is impossible (s).
NEVER_S = 1e6
# Ends of neighbours this close (m) along the lanes are beside each other.
BESIDE_M = 3.0
# Area (m²) that two neighbours leave between them where they turn apart, approximately.
SLIVER_M2 = 0.9


class TurnRoom(NamedTuple):
    """Lengths of a stroke taken up by turns (m): before its end, where the nose is at a wall, and after its start."""

    leave_m: float
    join_m: float


def turn_room(machine: CoverageMachine) -> TurnRoom:
    """Room that a half turn before a wall takes."""
    turn = ContinuousTurn(machine.curvature_max_1pm, machine.sharpness_max_1pm2)
    path = PiecePath(PathPose(0.0, 0.0, 0.0), turn.pieces(math.pi))
    x, _, heading, _ = path.sample(np.linspace(0.0, path.length_m, 200))
    corners = np.array(machine.outline).tolist()
    deep = float(max((x + np.cos(heading) * cx - np.sin(heading) * cy).max() for cx, cy in corners))
    return TurnRoom(deep - machine.nose_m, deep - machine.tail_m)


@dataclass(frozen=True)
class LaneOrder:
    """Search for the best order of lanes.

    Attributes:
        items: Lanes to order.
        angle_rad: Their direction.
        entries: Poses from which they may be entered.
        finder: Finds transitions, and has the coverage without turns and the price of uncovered ground.
        room: Lengths of a lane taken up by turns.
    """

    items: list[CoverLane]
    angle_rad: float
    entries: list[PathPose]
    finder: TransitionFinder
    room: TurnRoom

    def best(self) -> list[CoverStroke]:
        """Return the best of many annealed orders, scored with the true area that their turns cover."""
        if len(self.items) < 2:
            return [lane.along for lane in self.items]
        worth = self.finder.seconds_per_m2 * SLIVER_M2
        offers = {tuple(self._annealed(apart_s, seed).tolist()) for seed in range(STARTS) for apart_s in (0.0, worth)}
        return min(([self._strokes[k] for k in offer] for offer in sorted(offers)), key=self._score_s)

    @cached_property
    def _strokes(self) -> list[CoverStroke]:
        return [stroke for lane in self.items for stroke in (lane.along, lane.back)]

    @cached_property
    def _cost(self) -> Floats:
        ends, begins = (np.array([place(s) for s in self._strokes]) for place in (self._end, self._begin))
        cost: Floats = words_s(ends, begins, self.finder.mover)
        for k in range(0, len(cost), 2):
            cost[k : k + 2, k : k + 2] = NEVER_S
        return cost

    @cached_property
    def _entry(self) -> Floats:
        return np.array([self.entry_s(stroke) for stroke in self._strokes])

    def entry_s(self, stroke: CoverStroke) -> float:
        """Seconds to a stroke from the nearest entry."""
        if not self.entries:
            return 0.0
        begin = np.array([self._begin(stroke)])
        return float(words_s(np.array(self.entries), begin, self.finder.mover).min())

    def _begin(self, stroke: CoverStroke) -> PathPose:
        return stroke.at(min(self.room.join_m, 0.5 * stroke.length_m))

    def _end(self, stroke: CoverStroke) -> PathPose:
        return stroke.at(stroke.length_m - min(self.room.leave_m, 0.5 * stroke.length_m))

    def part(self, stroke: CoverStroke) -> PiecePath:
        """Path along a stroke without what turns take up at its ends."""
        half = 0.5 * stroke.length_m
        return stroke.part(min(self.room.join_m, half), stroke.length_m - min(self.room.leave_m, half))

    def word(self, first: CoverStroke, last: CoverStroke) -> PiecePath:
        """Shortest word from one stroke to the next, regardless of obstacles."""
        if (first, last) not in self._words:
            end, turn = self._end(first), self.finder.turn
            self._words[first, last] = PiecePath(end, shortest_word(end, self._begin(last), turn).pieces(turn))
        return self._words[first, last]

    def _spun_s(self, first: CoverStroke, last: CoverStroke) -> float:
        """Seconds of a transition with turns on the spot, stops included; infinite if the machine cannot turn so."""
        mover, amounts = self.finder.mover, np.empty(3)
        if not math.isfinite(mover.spin_lever_m):
            return math.inf
        seen, heading = self._begin(last).seen_from(self._end(first))
        spun_between(seen.real, seen.imag, heading, 1.0, amounts)
        return float(spun_s(amounts, mover)) + mover.speed_mps / mover.acceleration_mps2

    @cached_property
    def _words(self) -> dict[tuple[CoverStroke, CoverStroke], PiecePath]:
        """Cache of words: good orders have most of them in common."""
        return {}

    def _annealed(self, apart_s: float, seed: int) -> Ints:
        across = complex(-math.sin(self.angle_rad), math.cos(self.angle_rad))
        level = np.array([(lane.along.start.point * across.conjugate()).real for lane in self.items])
        steps = min(STEPS_PER_LANE * len(self.items), STEPS_MOST)
        start = np.array([2 * k + k % 2 for k in range(len(self.items))])
        costs = LaneCosts(self._cost, self._entry, level, self._neighbours, apart_s)
        found: Ints = annealed(start, costs, steps, HOT_S, seed)
        return found

    def _score_s(self, order: list[CoverStroke]) -> float:
        """Seconds for the transitions, less the price of what they cover."""
        seconds, gained, counted = self.entry_s(order[0]), 0.0, []
        for first, last in pairwise(order):
            word = self.word(first, last)
            seconds += min(word.length_m / self.finder.mover.speed_mps, self._spun_s(first, last))
            gained += self.finder.covered.add(word)
            counted.append(word)
        for word in counted:
            self.finder.covered.take(word)
        return seconds - self.finder.seconds_per_m2 * gained

    @cached_property
    def _neighbours(self) -> Ints:
        """Rows (p, 3) of lane, its upper neighbour, and the end at which they lie beside each other."""
        along = complex(math.cos(self.angle_rad), math.sin(self.angle_rad))
        ends = [
            (lane.back.at(lane.back.length_m).point / along, lane.along.at(lane.along.length_m).point / along)
            for lane in self.items
        ]
        found = [
            (i, j, side)
            for i, lane in enumerate(self.items)
            for j, other in enumerate(self.items)
            if other.row == lane.row + 1 and lane.row >= 0
            for side in range(2)
            if abs(ends[i][side].real - ends[j][side].real) < BESIDE_M
        ]
        return np.array(found, dtype=np.int64).reshape(-1, 3)
