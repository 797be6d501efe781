"""The cost matrix of an ordering problem: seconds from every end to every beginning, and for painting."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from touchline.core.angles import wrapped_all
from touchline.core.near_points import near_pairs
from touchline.services.planner.budget import UNWATCHED, Budget
from touchline.services.planner.geometry.clothoid import Floats, Ints
from touchline.services.planner.sequencing.order import Problem
from touchline.services.planner.steering.method import CurveEnd
from touchline.services.planner.swaths.chains import GAP_M
from touchline.services.planner.swaths.swaths import Painting, Swath
from touchline.services.planner.transitions.pricing import end_rows, pricing_of
from touchline.services.planner.transitions.transitions import TransitionFamily

# Every node's nearest neighbours are timed exactly; at the nearest of these methods with more transitions look closer.
TIMED, CLOSER = 12, 3
# Up to this many nodes all pairs are timed.
ALL_NODES = 200
# So many pairs take about 50 ms to time roughly, which is done when this share of all time has passed.
ROUGH_PART, ROUGH_DONE = 150_000, 0.15
# A segment is not painted twice, nor reached from itself.
NEVER_S = 1e6
# Pairs that differ by no more than rounding (m, rad, 1/m) take the same time.
ALIKE = 1e-7
# No pieces of transitions, and no counts.
NO_TRANSITIONS = np.zeros((0, 0, 5)), np.zeros(0, dtype=np.int64)


class Timing(NamedTuple):
    """One pass of timing pairs: a first one, or a `closer` one for methods that then try more transitions.

    At most `part` pairs are timed at once, in about 50 ms; after each part the budget may be used up. `begun` and
    `ended` are the fractions of all timing that are done before and after the pass.
    """

    closer: bool
    part: int
    begun: float
    ended: float


FIRST, SECOND = Timing(False, 3000, ROUGH_DONE, 0.25), Timing(True, 120, 0.25, 1.0)


@dataclass(frozen=True)
class Tracks:
    """The quickest transitions of a matrix.

    Attributes:
        paint_s: (nodes,) seconds that painting takes.
        kind: (ends, beginnings) which way, −1 where it has only been timed roughly.
        pieces: (transitions, k, 5) the columns of `Piece`, from the end of the painted segment on.
        counts: (transitions,) how many of them there are.
    """

    paint_s: Floats
    kind: Ints
    pieces: Floats
    counts: Ints

    def with_pairs(self, pairs: Ints, which: Ints, pieces: Floats, counts: Ints) -> "Tracks":
        """These and more transitions; pair i of `pairs` (n, 2) takes number `which[i]` of the new ones."""
        kind = self.kind.copy()
        kind[pairs[:, 0], pairs[:, 1]] = len(self.counts) + which
        pieces, counts = stacked([(self.pieces, self.counts), (pieces, counts)])
        return replace(self, kind=kind, pieces=pieces, counts=counts)


def nodes_of(modes: Sequence[Sequence[Swath]]) -> tuple[list[Swath], Ints, Ints]:
    """All modes as nodes, the swath that each paints, and the node that paints it in reverse (itself, if none can)."""
    nodes = [swath for group in modes for swath in group]
    segment = np.repeat(np.arange(len(modes)), [len(group) for group in modes])
    flip = np.arange(len(nodes))
    first = 0
    for group in modes:
        for i, swath in enumerate(group):
            for k, other in enumerate(group):
                if _turned_round(swath, other):
                    flip[first + i] = first + k
        first += len(group)
    return nodes, segment, flip


def _turned_round(swath: Swath, other: Swath) -> bool:
    """Whether two modes of a swath are each other's reverse."""
    first, last = swath.strokes[0], other.strokes[-1]
    x, y, _ = last.nozzle.end
    same = first.id == last.id and first.flipped != last.flipped
    return same and abs(complex(first.nozzle.x_m - x, first.nozzle.y_m - y)) < 1e-6


def problem(
    modes: Sequence[Sequence[Swath]],
    transitions: TransitionFamily,
    painting: Painting,
    start: CurveEnd | None,
    end: CurveEnd | None = None,
    budget: Budget = UNWATCHED,
) -> tuple[Problem, Tracks]:
    """The ordering problem, and the transitions behind it.

    Args:
        modes: For every swath the ways to paint it.
        transitions: The transitions of the method in use.
        painting: Decides what is painted in one go.
        start: Where the robot begins; None: every swath may come first, at no cost.
        end: Where it ends; None: every swath may be last, at no cost.
        budget: Told how far it is; if it has enough early, the costs are rougher.
    """
    nodes, segment, flip = nodes_of(modes)
    count = len(nodes)
    begins, ends = [n.begin for n in nodes], [n.end for n in nodes]
    cost = np.full((count + 1, count + 1), 0.0)
    paint = np.array([node.seconds for node in nodes])
    cost[:-1, :-1], tracks = seconds_between(ends, begins, transitions, segment, paint, budget)
    cost[:-1, :-1][segment[:, None] == segment[None, :]] = NEVER_S
    tracks = _going_on(nodes, painting, cost, tracks)
    if start is not None:
        cost[-1, :-1] = _timed_all([start], begins, transitions)
    if end is not None:
        cost[:-1, -1] = _timed_all(ends, [end], transitions)
    cost[:, :-1] += paint
    return Problem(cost, segment, flip), tracks


def _going_on(nodes: Sequence[Swath], painting: Painting, cost: Floats, tracks: Tracks) -> Tracks:
    """Lower the cost between swaths that join to the extra time of painting both in one go."""
    places = [np.array([end.pose[:2] for end in each]) for each in ([n.end for n in nodes], [n.begin for n in nodes])]
    pairs = []
    for a, b in near_pairs(places[0], places[1], GAP_M).tolist():
        if cost[a, b] >= NEVER_S:
            continue
        both = painting.in_one_go(nodes[a], nodes[b])
        longer_s = both.seconds - nodes[a].seconds - nodes[b].seconds if both else math.inf
        if longer_s < cost[a, b]:
            cost[a, b] = longer_s
            pairs.append((a, b))
    if not pairs:
        return tracks
    none = np.zeros((1, 0, 5)), np.zeros(1, dtype=np.int64)
    return tracks.with_pairs(np.array(pairs), np.zeros(len(pairs), dtype=np.int64), *none)


def seconds_between(
    ends: list[CurveEnd],
    begins: list[CurveEnd],
    transitions: TransitionFamily,
    segment: Ints,
    paint_s: Floats,
    budget: Budget,
) -> tuple[Floats, Tracks]:
    """Seconds (ends, begins) of the quickest transitions, rough for distant pairs; and the transitions.

    Args:
        ends: Where swaths end, node by node.
        begins: Where they begin, node by node.
        transitions: The transitions of the method in use.
        segment: (nodes,) which swath each node paints.
        paint_s: (nodes,) seconds that painting takes.
        budget: Told how far it is, and asked whether that is enough.
    """
    count = len(ends)
    tracks = Tracks(paint_s, np.full((count, count), -1), *NO_TRANSITIONS)
    table = _straight(ends, begins, transitions)
    if count <= ALL_NODES:
        pairs = _all_pairs(count, count)
    else:
        _rough(ends, begins, transitions, table, budget)
        pairs = _nearest(table, segment, TIMED)
    for timing in (FIRST, SECOND) if pricing_of(transitions).looks_closer else (FIRST._replace(ended=1.0),):
        if timing.closer:
            pairs = _nearest(table, segment, CLOSER)
        chosen, seconds, which, pieces, counts = _timed(ends, begins, transitions, pairs, timing, budget)
        done = pairs[chosen]
        table[done[:, 0], done[:, 1]] = seconds
        tracks = tracks.with_pairs(done, which, pieces, counts)
    return table, tracks


def _straight(ends: list[CurveEnd], begins: list[CurveEnd], transitions: TransitionFamily) -> Floats:
    """Seconds (ends, begins) of straight lines from each end to each beginning, headings ignored."""
    starts, goals = end_rows(ends), end_rows(begins)
    apart = np.hypot(*(goals[None, :, axis] - starts[:, None, axis] for axis in (0, 1)))
    return np.asarray(apart / transitions.limits.transit_speed_mps)


def _rough(
    ends: list[CurveEnd], begins: list[CurveEnd], transitions: TransitionFamily, table: Floats, budget: Budget
) -> None:
    """Fill in the rough seconds of the method in use."""
    for part in budget.parts(len(ends), max(ROUGH_PART // len(begins), 1), 0.0, ROUGH_DONE):
        table[part] = pricing_of(transitions).rough_s(transitions, ends[part], begins)


def _nearest(table: Floats, segment: Ints, count: int) -> Ints:
    """The pairs of each end with its cheapest beginnings, and of each beginning with its cheapest ends."""
    open_ = np.where(segment[:, None] == segment[None, :], np.inf, table)
    count = min(count, len(table) - 1)
    if count < 1:
        return np.zeros((0, 2), dtype=np.int64)
    chosen = np.zeros(table.shape, dtype=bool)
    np.put_along_axis(chosen, np.argpartition(open_, count - 1, axis=1)[:, :count], True, axis=1)
    np.put_along_axis(chosen, np.argpartition(open_, count - 1, axis=0)[:count], True, axis=0)
    return np.argwhere(chosen & np.isfinite(open_))


def _all_pairs(starts: int, goals: int) -> Ints:
    return np.stack(np.divmod(np.arange(starts * goals), goals), axis=1)


def _timed_all(ends: list[CurveEnd], begins: list[CurveEnd], transitions: TransitionFamily) -> Floats:
    """Seconds (n,), timed in a first pass, from one end to all beginnings or from all ends to one beginning."""
    pairs = _all_pairs(len(ends), len(begins))
    return _timed(ends, begins, transitions, pairs, FIRST, UNWATCHED)[1]


def _timed(
    ends: list[CurveEnd],
    begins: list[CurveEnd],
    transitions: TransitionFamily,
    pairs: Ints,
    timing: Timing,
    budget: Budget,
) -> tuple[Ints, Floats, Ints, Floats, Ints]:
    """Time pairs until the budget is used up; pairs that differ only in where they lie share one transition.

    Returns:
        Which (n,) of the `pairs` were timed, seconds (n,) of their quickest transitions, the number (n,) of each one's
        transition, and the pieces (m, k, 5) and counts (m,) of the transitions.
    """
    first, alike = _alike(end_rows(ends)[pairs[:, 0]], end_rows(begins)[pairs[:, 1]])
    pairs = pairs[first]
    price = pricing_of(transitions).timer(transitions, ends, begins)
    size = min(timing.part, pricing_of(transitions).part)
    priced = [price(pairs[part], timing.closer) for part in budget.parts(len(pairs), size, timing.begun, timing.ended)]
    seconds = np.concatenate([np.zeros(0), *(each.seconds for each in priced)])
    pieces, counts = stacked([NO_TRANSITIONS, *((each.pieces, each.counts) for each in priced)])
    chosen = np.flatnonzero(alike < len(seconds))
    which = alike[chosen]
    return chosen, seconds[which], which, pieces, counts


def stacked(tables: Sequence[tuple[Floats, Ints]]) -> tuple[Floats, Ints]:
    """Pieces (n, k, 5) and counts (n,) of transitions as one table, as wide as the widest."""
    most = max(pieces.shape[1] for pieces, _ in tables)
    wide = [np.pad(pieces, ((0, 0), (0, most - pieces.shape[1]), (0, 0))) for pieces, _ in tables]
    return np.concatenate(wide), np.concatenate([counts for _, counts in tables])


def _alike(starts: Floats, goals: Floats) -> tuple[Ints, Ints]:
    """Groups pairs (rows of both) that differ only in where they lie: the first of each group, and each pair's group.

    On an American football field only one pair in ten begins a new group.
    """
    apart = (goals[:, 0] - starts[:, 0] + 1j * (goals[:, 1] - starts[:, 1])) * np.exp(-1j * starts[:, 2])
    turn = wrapped_all(goals[:, 2] - starts[:, 2])
    seen = np.column_stack((apart.real, apart.imag, turn, starts[:, 3:], goals[:, 3:]))
    grid = np.rint(seen / ALIKE).astype(np.int64)
    _, first, alike = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    return first, alike.reshape(-1)
