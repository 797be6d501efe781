"""The tour: the cheapest order and directions of the segments over a cost matrix, by iterated local search."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from touchline.services.planner.budget import UNWATCHED, Budget
from touchline.services.planner.geometry.clothoid import Floats, Ints
from touchline.services.planner.sequencing.blocks import board_of
from touchline.services.planner.sequencing.search import CostTables, Kicks, best_modes, improve, tour_cost

# How many of the cheapest successors and predecessors a search looks at.
NEIGHBOURS = 12
# The budget: so many kicks for every segment, within bounds. It says how good the order is, not how long it takes.
KICKS_PER_SEGMENT, KICKS_MIN, KICKS_MAX = 800, 10_000, 60_000
# Kicks between two looks at whether that is enough.
RUN = 2000
SEED = 20


@dataclass(frozen=True)
class Problem:
    """An ordering problem.

    Attributes:
        cost: (nodes + 1, nodes + 1) seconds from node to node, painting the second included; the last row is from the
            start to a node, the last column from a node to the end.
        segment: (nodes,) which segment each node paints.
        flip: (nodes,) the node that paints the same the other way round (itself, if there is none).
    """

    cost: Floats
    segment: Ints
    flip: Ints

    @property
    def segments(self) -> int:
        """How many segments there are."""
        return int(self.segment.max()) + 1

    @property
    def depot(self) -> int:
        """The node behind the last one: the start, and the end."""
        return len(self.segment)

    @cached_property
    def with_depot(self) -> tuple[Ints, Ints]:
        """`segment` and `flip` (nodes + 1,) with those of the depot, which is a segment of its own."""
        return np.append(self.segment, self.segments), np.append(self.flip, self.depot)

    @cached_property
    def after(self) -> Ints:
        """(nodes + 1, neighbours) the cheapest successors of each node."""
        return _cheapest(self.cost, self.with_depot[0])

    @cached_property
    def before(self) -> Ints:
        """(nodes + 1, neighbours) the cheapest predecessors of each node."""
        return _cheapest(self.cost.T, self.with_depot[0])

    @cached_property
    def modes(self) -> Ints:
        """(segments + 1, most modes) the nodes of each segment and of the depot, −1 beyond the last."""
        groups = [np.flatnonzero(self.segment == k) for k in range(self.segments)] + [np.array([self.depot])]
        table = np.full((len(groups), max(map(len, groups))), -1, dtype=np.int64)
        for row, group in zip(table, groups, strict=True):
            row[: len(group)] = group
        return table

    def priced(self, cost: Floats) -> "Problem":
        """The same problem with another matrix."""
        return replace(self, cost=cost)

    def cost_of(self, nodes: Ints) -> float:
        """Seconds for the nodes in this order, from the start to the end."""
        return float(tour_cost(self.cost, np.concatenate(([self.depot], nodes))))


def ordered(problem: Problem, budget: Budget = UNWATCHED, kicks: int | None = None, begin: Ints | None = None) -> Ints:
    """The nodes (segments,) in the best order found, from `begin` on if that is given.

    The budget may end the search after the first kicks. If it does not, the result depends on the problem alone.

    Args:
        problem: What is ordered.
        budget: Told how far it is, and asked whether that is enough.
        kicks: How many of them; by default `kicks_for` the problem.
        begin: (segments,) nodes to begin with; by default each time on to the cheapest next one.
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
    """The budget of kicks for a problem."""
    return min(max(KICKS_PER_SEGMENT * problem.segments, KICKS_MIN), KICKS_MAX)


def _cheapest(cost: Floats, segment: Ints) -> Ints:
    """(nodes, NEIGHBOURS) the cheapest partners of each node that are of other segments, cheapest first."""
    table = np.where(segment[:, None] == segment[None, :], np.inf, cost)
    count = min(NEIGHBOURS, len(segment) - 1)
    near = np.argpartition(table, count - 1, axis=1)[:, :count]
    rank = np.argsort(np.take_along_axis(table, near, axis=1), axis=1, kind="stable")
    return np.ascontiguousarray(np.take_along_axis(near, rank, axis=1))


def _nearest(cost: Floats, segment: Ints, segments: int) -> Ints:
    """A first tour by the nearest-neighbour rule: always on to the cheapest next node."""
    at = len(segment) - 1
    open_, tour = np.ones(len(segment), dtype=bool), [at]
    open_[at] = False
    for _ in range(segments):
        at = int(np.argmin(np.where(open_, cost[at], np.inf)))
        open_[segment == segment[at]] = False
        tour.append(at)
    return np.array(tour)
