"""Order of moves that brings all robots to their goals on a roadmap, where most places have room for one.

Moves are made one after another, each while all others stand, so an order that leads to the goals contains no robots
that wait for each other in a circle. Driven at once, each move waits only for those before it that come near to it
(`ordered_ways.py`).

Two searches find orders. *By priority*: in each round robots move towards their goals, those who have waited longest
first; who stands in the way is pushed on (priority inheritance, Okumura et al., Artificial Intelligence 310, 2022).
This is fast, but two robots that have to pass each other in a corridor may push each other to and fro for ever. *One
goal after another*: goals are taken in such an order that those taken cut off none of the others, dead ends first. All
robots that are on the way to the next goal, or behind it, move aside; then its robot goes there, and stays.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.plans.move_map import MoveMap

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

_ROUNDS: Final = 400
_TRIES_BY_PRIORITY: Final = 4
_TRIES_BY_GOAL: Final = 150
_TRIES_FOR_BETTER: Final = 30
"""Tries after which one order is enough."""
_ENOUGH: Final = 6
"""Number of orders of which the one with the shortest duration is taken."""
_MOVES_ASIDE: Final = 150
_LUCK_M: Final = 0.1
"""Largest random part of the cost of a place, to get out of circles…"""
_MORE_LUCK_M: Final = 0.01
"""…and how much it grows in every round of moving aside."""
_BEHIND_M: Final = 3.0
"""Cost of a goal for each robot behind it."""
_LIKED_LESS_M: Final = 100.0
_STANDS_M: Final = 1.0
"""Cost of leaving a place where a robot may stay."""
# For an estimate of the duration of an order: speed, and time to begin a move.
_SPEED_MPS: Final = 0.4
_BEGINS_S: Final = 0.5


class Move(NamedTuple):
    """A move of a robot, by its number in the roadmap."""

    robot: int
    move: int


Cost = Callable[[int, int], float]
"""Cost of a place for a robot (m)."""


class _Round:
    """A round in which every robot makes at most one move.

    Attributes:
        at: Place of each robot.
        made: Moves made.
    """

    def __init__(
        self, roadmap: MoveMap, at: Sequence[int], cost: Cost, rng: np.random.Generator, luck_m: float
    ) -> None:
        self._roadmap, self._cost, self._rng, self._luck_m = roadmap, cost, rng, luck_m
        self.at = list(at)
        self.made: list[Move] = []
        self._on = {place: robot for robot, place in enumerate(at)}
        self._done = set[int]()

    def run(self, order: Sequence[int], fixed: Collection[int] = ()) -> None:
        """Let robots move.

        Args:
            order: Robots, most urgent first.
            fixed: Robots that stay.
        """
        self._done.update(fixed)
        for robot in order:
            if robot not in self._done:
                self._push(robot, frozenset())

    def _push(self, robot: int, forbidden: frozenset[int]) -> bool:
        """Let a robot make the move that it likes best, and push on who stands in its way.

        Args:
            robot: The robot.
            forbidden: Places where it may not stand afterwards.

        Returns:
            Whether it stands elsewhere than in a forbidden place.
        """
        here, roadmap = self.at[robot], self._roadmap
        self._done.add(robot)
        moves = roadmap.moves_from[here]
        luck_m = self._luck_m * self._rng.random(len(moves) + 1)
        costs = [(self._cost(robot, here) + luck_m[-1], False, -1)]
        for move, luck in zip(moves, luck_m, strict=False):
            end = int(roadmap.ends[move])
            costs.append((self._cost(robot, end) + luck, end in self._on, move))
        for _, _, move in sorted(costs):
            if move < 0 and here not in forbidden:
                return True
            if move >= 0 and int(roadmap.ends[move]) not in forbidden and self._clear(robot, move, forbidden):
                self._make(Move(robot, move))
                return True
        return False

    def _clear(self, robot: int, move: int, forbidden: frozenset[int]) -> bool:
        """Push on all that stand in the way of a move; return whether it is free then."""
        closed = np.flatnonzero(self._roadmap.closed[move]).tolist()
        others = [other for place in closed if (other := self._on.get(place, robot)) != robot]
        if any(other in self._done for other in others):
            return False
        kept_clear = forbidden.union(closed, (self.at[robot],))
        for other in others:
            if other not in self._done and not self._push(other, kept_clear):
                return False
        return all(self._on.get(place, robot) == robot for place in closed)

    def _make(self, made: Move) -> None:
        del self._on[self.at[made.robot]]
        self.at[made.robot] = int(self._roadmap.ends[made.move])
        self._on[self.at[made.robot]] = made.robot
        self.made.append(made)


class MoveOrder:
    """Search for an order of moves on a roadmap."""

    def __init__(self, roadmap: MoveMap, goals: Sequence[int], seed: int = 0) -> None:
        """Prepare it.

        Args:
            roadmap: The roadmap.
            goals: Place to which each robot is to come; no two may be closed to each other.
            seed: Seed of the random parts.
        """
        self._roadmap, self._goals = roadmap, list(goals)
        self._rng = np.random.default_rng(seed)
        self._left_m = self._to(self._goals, ())

    def _to(self, places: Sequence[int], taken: Collection[int]) -> Floats:
        """Return (len(places), n) the way from every place to each of some, past robots that stand (m)."""
        from scipy.sparse.csgraph import dijkstra

        found: Floats = dijkstra(self._roadmap.graph(taken).T, indices=np.array(places))
        return found

    def find(self, starts: Sequence[int]) -> list[Move] | None:
        """Return an order of moves, of some the one with the shortest duration; None if none is found.

        Args:
            starts: Place of each robot.
        """
        found, begun = list[list[Move]](), [(list[Move](), list(starts))]
        for attempt in range(_TRIES_BY_PRIORITY):
            moves, at = self._by_priority(list(starts), attempt * _LUCK_M)
            if at == self._goals:
                found.append(moves)
            elif moves:
                begun.append((moves, at))
        for attempt in range(_TRIES_BY_GOAL):
            if len(found) >= (_ENOUGH if attempt < _TRIES_FOR_BETTER else 1):
                break
            before, at = begun[attempt % len(begun)]
            moves, at = self._by_goal(list(at))
            if at == self._goals:
                found.append(before + moves)
        found = [without_loops(moves, self._roadmap) for moves in found]
        return min(found, key=self.duration_s, default=None)

    def duration_s(self, moves: Sequence[Move]) -> float:
        """Return an estimate of the time in which an order is driven."""
        free_s, ready_s = np.zeros(len(self._roadmap.places)), np.zeros(len(self._goals))
        for robot, move in moves:
            near = self._roadmap.closed[move].copy()
            near[self._roadmap.starts[move]] = True
            begins_s = max(ready_s[robot], free_s[near].max())
            ready_s[robot] = begins_s + _BEGINS_S + self._roadmap.lengths_m[move] / _SPEED_MPS
            free_s[near] = ready_s[robot]
        return float(ready_s.max())

    def _by_priority(self, at: list[int], luck_m: float) -> tuple[list[Move], list[int]]:
        """Move all robots towards their goals, those first who have waited longest.

        Returns:
            Moves until most of them were there, and their places then.
        """
        lengths_m = [float(self._left_m[robot, place]) for robot, place in enumerate(at)]
        ranks = list(np.argsort(np.argsort(lengths_m)) / len(at))
        waited, made, best = list(ranks), list[Move](), (len(at) + 1, 0, at)
        for _ in range(_ROUNDS):
            left = sum(place != goal for place, goal in zip(at, self._goals, strict=True))
            best = min(best, (left, len(made), at), key=lambda state: state[0])
            if not left:
                break
            turn = _Round(self._roadmap, at, lambda robot, place: self._left_m[robot, place], self._rng, luck_m)
            turn.run(sorted(range(len(at)), key=lambda robot: -waited[robot]))
            at, made = turn.at, made + turn.made
            waited = [
                rank if place == goal else wait + 1.0
                for place, goal, wait, rank in zip(at, self._goals, waited, ranks, strict=True)
            ]
        return made[: best[1]], best[2]

    def _by_goal(self, at: list[int]) -> tuple[list[Move], list[int]]:
        """Bring one robot after another to its goal, where it stays."""
        made, fixed = list[Move](), list[int]()
        while len(fixed) < len(at) and (chosen := self._next_goal(at, fixed)) is not None:
            robot, main = chosen
            moves, at = self._bring(robot, at, fixed, main)
            made += moves
            if at[robot] != self._goals[robot]:
                break
            fixed.append(robot)
        return made, at

    def _next_goal(self, at: Sequence[int], fixed: Sequence[int]) -> tuple[int, Bools] | None:
        """Return whose goal is next, and (n,) the part of the area in which all other goals are; None if there is none.

        Costs are the way there, and robots behind the goal, with some luck.
        """
        from scipy.sparse.csgraph import connected_components

        taken = [at[robot] for robot in fixed]
        left = [robot for robot in range(len(at)) if robot not in fixed]
        ways_m = self._to([self._goals[robot] for robot in left], taken)
        best, found = math.inf, None
        for robot, way_m in zip(left, ways_m, strict=True):
            _, part = connected_components(self._roadmap.graph([*taken, self._goals[robot]]), directed=False)
            parts = {int(part[self._goals[other]]) for other in left if other != robot}
            main = part == parts.pop() if parts else np.ones(len(part), dtype=np.bool_)
            behind = sum(not main[at[other]] for other in left if other != robot)
            cost_m = way_m[at[robot]] + _BEHIND_M * (behind + self._rng.exponential())
            if not parts and cost_m < best:
                best, found = cost_m, (robot, main)
        return found

    def _bring(self, robot: int, at: list[int], fixed: Sequence[int], main: Bools) -> tuple[list[Move], list[int]]:
        """Move a robot to its goal, after all others have moved out of its way into the main part."""
        made, taken, goal = list[Move](), [at[other] for other in fixed], self._goals[robot]
        for attempt in range(_MOVES_ASIDE):
            path = self._path(at[robot], goal, taken)
            way: Bools = np.any(self._roadmap.closed[path], axis=0)
            way[[at[robot], goal]] = True
            others = [other for other in range(len(at)) if other != robot and other not in fixed]
            hinder = [other for other in others if way[at[other]] or not main[at[other]]]
            if not hinder:
                at[robot] = goal
                return made + [Move(robot, move) for move in path], at
            aside = main & ~way
            aside[[at[other] for other in others if other not in hinder]] = False
            if not aside.any():
                break
            cost_m = self._cost_aside(np.flatnonzero(aside), taken, at[robot])
            moves, at = self._move_aside(at, hinder, fixed, cost_m, _LUCK_M + attempt * _MORE_LUCK_M)
            made += moves
        return made, at

    def _cost_aside(self, aside: Ints, taken: Sequence[int], held: int) -> Floats:
        """Return (n,) the way to the nearest of some places (m), if possible past a robot that is not to be pushed."""
        from scipy.sparse.csgraph import dijkstra

        past, any_m = (
            dijkstra(self._roadmap.graph(standing).T, indices=aside, min_only=True)
            for standing in ([*taken, held], taken)
        )
        found: Floats = np.where(np.isfinite(past), past, any_m + _LIKED_LESS_M)
        return found

    def _move_aside(
        self, at: list[int], hinder: list[int], fixed: Sequence[int], cost_m: Floats, luck_m: float
    ) -> tuple[list[Move], list[int]]:
        """Let a round pass in which some robots move to places of lower cost, and all others stay unless pushed."""
        before = list(at)

        def cost(robot: int, place: int) -> float:
            moved = 0.0 if robot in hinder else _STANDS_M
            return 0.0 if moved and place == before[robot] else moved + float(cost_m[place])

        turn = _Round(self._roadmap, at, cost, self._rng, luck_m)
        hinder.sort(key=lambda robot: float(cost_m[at[robot]]))
        turn.run([*hinder, *(robot for robot in range(len(at)) if robot not in hinder)], fixed)
        return turn.made, turn.at

    def _path(self, start: int, goal: int, taken: Sequence[int]) -> list[int]:
        """Return the moves of the shortest way from a place to another, past robots that stand."""
        left_m = self._to([goal], taken)[0]
        found, here, roadmap = list[int](), start, self._roadmap
        while here != goal:
            free = [move for move in roadmap.moves_from[here] if not roadmap.closed[move, taken].any()]
            found.append(min(free, key=lambda move: roadmap.lengths_m[move] + left_m[roadmap.ends[move]]))
            here = int(roadmap.ends[found[-1]])
        return found


def without_loops(moves: Sequence[Move], roadmap: MoveMap) -> list[Move]:
    """Return an order without those ways there and back for which there is no reason."""
    kept = list(moves)
    for robot in {move.robot for move in moves}:
        own = [number for number, move in enumerate(kept) if move.robot == robot]
        drop, first = set[int](), 0
        while first < len(own):
            last = _end_of_loop(kept, own[first:], roadmap)
            drop.update(own[first : first + last])
            first += max(last, 1)
        kept = [move for number, move in enumerate(kept) if number not in drop]
    return kept


def _end_of_loop(moves: Sequence[Move], own: Sequence[int], roadmap: MoveMap) -> int:
    """Return how many of a robot's moves, given by their numbers, lead it back to where it could have stayed."""
    robot, begins = moves[own[0]]
    place, found = int(roadmap.starts[begins]), 0
    needed = [
        number
        for number in range(own[0], own[-1])
        if moves[number].robot != robot
        and (roadmap.closed[moves[number].move, place] or roadmap.starts[moves[number].move] == place)
    ]
    for count, number in enumerate(own, start=1):
        if needed and number > needed[0]:
            break
        if roadmap.ends[moves[number].move] == place:
            found = count
    return found
