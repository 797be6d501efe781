"""The order in which lanes are driven, and which way."""

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from touchline.services.planner.coverage.cover_stroke import CoverStroke
from touchline.services.planner.coverage.kernels.lane_anneal import LaneCosts, annealed
from touchline.services.planner.coverage.kernels.turn_words import Mover, spun_between, spun_s, words_s
from touchline.services.planner.coverage.lanes import CoverLane
from touchline.services.planner.coverage.machine import CoverageMachine
from touchline.services.planner.coverage.stroke_join import Joiner
from touchline.services.planner.geometry.clothoid import Floats, Ints, PathPose, PiecePath
from touchline.services.planner.steering.turns import ContinuousTurn
from touchline.services.planner.steering.words import shortest_word

# Steps of the search for each lane, within bounds; its first temperature (s) and how often it is begun anew.
STEPS_PER_LANE, STEPS_MOST, HOT_S, STARTS = 3000, 200_000, 20.0, 12
# What is never taken (s).
NEVER_S = 1e6
# Ends of neighbours this close (m) along the lanes are beside each other.
BESIDE_M = 3.0
# What two neighbours leave between them where they turn apart (m²), about.
SLIVER_M2 = 0.9


class TurnRoom(NamedTuple):
    """How much of a stroke turns take: before its end, where the nose is at a wall, and behind its beginning (m)."""

    leave_m: float
    join_m: float


def turn_room(machine: CoverageMachine) -> TurnRoom:
    """What a half turn before a wall across takes."""
    turn = ContinuousTurn(machine.curvature_max_1pm, machine.sharpness_max_1pm2)
    path = PiecePath(PathPose(0.0, 0.0, 0.0), turn.pieces(math.pi))
    x, _, heading, _ = path.sample(np.linspace(0.0, path.length_m, 200))
    corners = np.array(machine.outline).tolist()
    deep = float(max((x + np.cos(heading) * cx - np.sin(heading) * cy).max() for cx, cy in corners))
    return TurnRoom(deep - machine.nose_m, deep - machine.tail_m)


@dataclass(frozen=True)
class LaneOrder:
    """What an order of lanes is judged by.

    Attributes:
        items: The lanes.
        angle_rad: Their direction.
        entries: Where the way to them may begin.
        joiner: Knows how the machine moves, what is covered but for turns, and what a square metre is worth.
        room: What turns take of a lane.
    """

    items: list[CoverLane]
    angle_rad: float
    entries: list[PathPose]
    joiner: Joiner
    room: TurnRoom

    def best(self) -> list[CoverStroke]:
        """The best of many orders found by annealing, with the true area that their turns cover."""
        if len(self.items) < 2:
            return [lane.along for lane in self.items]
        worth = self.joiner.seconds_per_m2 * SLIVER_M2
        offers = {tuple(self._annealed(apart_s, seed).tolist()) for seed in range(STARTS) for apart_s in (0.0, worth)}
        return min(([self._strokes[k] for k in offer] for offer in sorted(offers)), key=self._score_s)

    @cached_property
    def _strokes(self) -> list[CoverStroke]:
        return [stroke for lane in self.items for stroke in (lane.along, lane.back)]

    @cached_property
    def _cost(self) -> Floats:
        ends, begins = (np.array([place(s) for s in self._strokes]) for place in (self._end, self._begin))
        cost: Floats = words_s(ends, begins, self.joiner.mover)
        for k in range(0, len(cost), 2):
            cost[k : k + 2, k : k + 2] = NEVER_S
        return cost

    @cached_property
    def _entry(self) -> Floats:
        return np.array([self.entry_s(stroke) for stroke in self._strokes])

    def entry_s(self, stroke: CoverStroke) -> float:
        """Seconds to a stroke from the nearest entry."""
        begin = self._begin(stroke)
        return min((word_s(pose, begin, self.joiner.mover) for pose in self.entries), default=0.0)

    def _begin(self, stroke: CoverStroke) -> PathPose:
        return stroke.at(min(self.room.join_m, 0.5 * stroke.length_m))

    def _end(self, stroke: CoverStroke) -> PathPose:
        return stroke.at(stroke.length_m - min(self.room.leave_m, 0.5 * stroke.length_m))

    def part(self, stroke: CoverStroke) -> PiecePath:
        """What of a stroke is left between turns."""
        half = 0.5 * stroke.length_m
        return stroke.part(min(self.room.join_m, half), stroke.length_m - min(self.room.leave_m, half))

    def word(self, first: CoverStroke, last: CoverStroke) -> PiecePath:
        """The shortest word from one to the next, whatever is in its way."""
        if (first, last) not in self._words:
            end, turn = self._end(first), self.joiner.turn
            self._words[first, last] = PiecePath(end, shortest_word(end, self._begin(last), turn).pieces(turn))
        return self._words[first, last]

    def _spun_s(self, first: CoverStroke, last: CoverStroke) -> float:
        """Seconds from one to the next with turns on the spot and the stops that they take; infinite if it has none."""
        mover, amounts = self.joiner.mover, np.empty(3)
        if not math.isfinite(mover.spin_lever_m):
            return math.inf
        seen, heading = self._begin(last).seen_from(self._end(first))
        spun_between(seen.real, seen.imag, heading, 1.0, amounts)
        return float(spun_s(amounts, mover)) + mover.speed_mps / mover.acceleration_mps2

    @cached_property
    def _words(self) -> dict[tuple[CoverStroke, CoverStroke], PiecePath]:
        """Those found so far: good orders have most in common."""
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
        """Seconds for the ways between, less what they cover is worth."""
        seconds, gained, counted = self.entry_s(order[0]), 0.0, []
        for first, last in pairwise(order):
            word = self.word(first, last)
            seconds += min(word.length_m / self.joiner.mover.speed_mps, self._spun_s(first, last))
            gained += self.joiner.covered.add(word)
            counted.append(word)
        for word in counted:
            self.joiner.covered.take(word)
        return seconds - self.joiner.seconds_per_m2 * gained

    @cached_property
    def _neighbours(self) -> Ints:
        """(p, 3) lane, its upper neighbour, and the end at which they lie beside each other."""
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


def word_s(start: PathPose, goal: PathPose, mover: Mover) -> float:
    """Seconds for the shortest word between two poses, whatever is in its way."""
    return float(words_s(np.array([start]), np.array([goal]), mover)[0, 0])
