"""Tour: the cheapest order and directions of the segments over a cost matrix, by iterated local search."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from touchline.services.planner.budget import UNWATCHED, Budget
from touchline.services.planner.geometry.clothoid import Floats, Ints
from touchline.services.planner.sequencing.blocks import board_of
from touchline.services.planner.sequencing.search import CostTables, Kicks, best_modes, improve, tour_cost

# Number of cheapest successors and predecessors in the neighbour lists.
NEIGHBOURS = 12
# Budget: kicks per segment, within bounds. It sets the quality of the order, not a time.
KICKS_PER_SEGMENT, KICKS_MIN, KICKS_MAX = 800, 10_000, 60_000
# Kicks between two checks of the budget.
RUN = 2000
SEED = 20


@dataclass(frozen=True)
class Problem:
    """An ordering problem.

    Attributes:
        cost: (nodes + 1, nodes + 1) seconds from node to node, painting the second included; the last row is from the
            start to a node, the last column from a node to the end.
        segment: (nodes,) segment that each node paints.
        flip: (nodes,) node that paints it in the opposite direction (itself, if there is none).
    """

    cost: Floats
    segment: Ints
    flip: Ints

    @property
    def segments(self) -> int:
        """Number of segments."""
        return int(self.segment.max()) + 1

    @property
    def depot(self) -> int:
        """Number of the depot, after the last node: the start, and the end."""
        return len(self.segment)

    @cached_property
    def with_depot(self) -> tuple[Ints, Ints]:
        """Arrays `segment` and `flip` (nodes + 1,) with the depot, which is a segment of its own."""
        return np.append(self.segment, self.segments), np.append(self.flip, self.depot)

    @cached_property
    def after(self) -> Ints:
        """Cheapest successors (nodes + 1, neighbours) of each node."""
        return _cheapest(self.cost, self.with_depot[0])

    @cached_property
    def before(self) -> Ints:
        """Cheapest predecessors (nodes + 1, neighbours) of each node."""
        return _cheapest(self.cost.T, self.with_depot[0])

    @cached_property
    def modes(self) -> Ints:
        """Nodes (segments + 1, most modes) of each segment and of the depot, −1 beyond the last."""
        groups = [np.flatnonzero(self.segment == k) for k in range(self.segments)] + [np.array([self.depot])]
        table = np.full((len(groups), max(map(len, groups))), -1, dtype=np.int64)
        for row, group in zip(table, groups, strict=True):
            row[: len(group)] = group
        return table

    def priced(self, cost: Floats) -> "Problem":
        """Copy of the problem with another matrix."""
        return replace(self, cost=cost)

    def cost_of(self, nodes: Ints) -> float:
        """Seconds for the nodes in this order, from the start to the end."""
        return float(tour_cost(self.cost, np.concatenate(([self.depot], nodes))))


def ordered(problem: Problem, budget: Budget = UNWATCHED, kicks: int | None = None, begin: Ints | None = None) -> Ints:
    """Find the best order of nodes (segments,), from `begin` on if that is given.

    The budget may end the search after the first kicks. If it does not, the result depends on the problem only.

    Args:
        problem: Ordering problem.
        budget: Reports progress, and may end the search.
        kicks: Number of kicks; by default `kicks_for` the problem.
        begin: (segments,) initial order; by default that of the nearest-neighbour rule.
    """
    cost, (segment, flip) = problem.cost, problem.with_depot
    tables = CostTables(cost, segment, flip, problem.modes, problem.after, problem.before)
    tour = _nearest(cost, segment, problem.segments) if begin is None else np.concatenate(([problem.depot], begin))
    board, best, lengths = board_of(tour, flip), tour.copy(), np.zeros(2)
    kicks = kicks_for(problem) if kicks is None else kicks
    for first in range(0, kicks, RUN):
        last = min(first + RUN, kicks)
        improve(tables, board, best, lengths, Kicks(SEED, first, last, kicks))
        budget.step(last / kicks)
        if budget.enough():
            break
    return np.asarray(best_modes(cost, segment, problem.modes, best)[1:])


def kicks_for(problem: Problem) -> int:
    """Number of kicks for a problem."""
    return min(max(KICKS_PER_SEGMENT * problem.segments, KICKS_MIN), KICKS_MAX)


def _cheapest(cost: Floats, segment: Ints) -> Ints:
    """Cheapest partners (nodes, NEIGHBOURS) of each node in other segments, cheapest first."""
    table = np.where(segment[:, None] == segment[None, :], np.inf, cost)
    count = min(NEIGHBOURS, len(segment) - 1)
    near = np.argpartition(table, count - 1, axis=1)[:, :count]
    rank = np.argsort(np.take_along_axis(table, near, axis=1), axis=1, kind="stable")
    return np.ascontiguousarray(np.take_along_axis(near, rank, axis=1))


def _nearest(cost: Floats, segment: Ints, segments: int) -> Ints:
    """Initial tour by the nearest-neighbour rule: always on to the cheapest next node."""
    at = len(segment) - 1
    open_, tour = np.ones(len(segment), dtype=bool), [at]
    open_[at] = False
    for _ in range(segments):
        at = int(np.argmin(np.where(open_, cost[at], np.inf)))
        open_[segment == segment[at]] = False
        tour.append(at)
    return np.array(tour)
