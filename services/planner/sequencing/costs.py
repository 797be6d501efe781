"""Cost matrix of an ordering problem: seconds from every end to every beginning, painting included."""

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

# Number of nearest neighbours of a node that are timed exactly, and of those that are examined for more transitions.
TIMED, CLOSER = 12, 3
# Up to this many nodes all pairs are timed.
ALL_NODES = 200
# Number of pairs whose rough timing takes about 50 ms, and the share of all timing that is rough.
ROUGH_PART, ROUGH_DONE = 150_000, 0.15
# Price of impossible transitions: a segment is not painted twice, nor reached from itself.
NEVER_S = 1e6
# Pairs that differ by less (m, rad, 1/m) are rounded copies and take the same time.
ALIKE = 1e-7
# No pieces of transitions, and no counts.
NO_TRANSITIONS = np.zeros((0, 0, 5)), np.zeros(0, dtype=np.int64)


class Timing(NamedTuple):
    """One pass of timing pairs: the first one, or a `closer` one for methods that then try more transitions.

    At most `part` pairs are timed at once, in about 50 ms; after each part the budget may end the pass. `begun` and
    `ended` are the fractions of all timing that are done before and after it.
    """

    closer: bool
    part: int
    begun: float
    ended: float


FIRST, SECOND = Timing(False, 3000, ROUGH_DONE, 0.25), Timing(True, 120, 0.25, 1.0)


@dataclass(frozen=True)
class QuickestTransitions:
    """Quickest transitions of a cost matrix.

    Attributes:
        paint_s: (nodes,) painting time (s).
        kind: (ends, beginnings) number of the transition, −1 where it has only been timed roughly.
        pieces: (transitions, k, 5) columns of `Piece`, from the end of the painted segment on.
        counts: (transitions,) numbers of pieces.
    """

    paint_s: Floats
    kind: Ints
    pieces: Floats
    counts: Ints

    def with_pairs(self, pairs: Ints, which: Ints, pieces: Floats, counts: Ints) -> "QuickestTransitions":
        """Add transitions; pair i of `pairs` (n, 2) takes number `which[i]` of the new ones."""
        kind = self.kind.copy()
        kind[pairs[:, 0], pairs[:, 1]] = len(self.counts) + which
        pieces, counts = stacked([(self.pieces, self.counts), (pieces, counts)])
        return replace(self, kind=kind, pieces=pieces, counts=counts)


def nodes_of(modes: Sequence[Sequence[Swath]]) -> tuple[list[Swath], Ints, Ints]:
    """List all modes as nodes, with the number of each one's swath and its reverse node (itself, if there is none)."""
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
    """True if two modes of a swath are each other's reverse."""
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
) -> tuple[Problem, QuickestTransitions]:
    """Set up the ordering problem, and the transitions behind its costs.

    Args:
        modes: Modes of every swath.
        transitions: Transitions of the method in use.
        painting: Rules of what is painted without a break.
        start: Start of the robot; None: every swath may be first, at no cost.
        end: End of the tour; None: every swath may be last, at no cost.
        budget: Reports progress; if it ends the timing early, the costs are rougher.
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


def _going_on(
    nodes: Sequence[Swath], painting: Painting, cost: Floats, tracks: QuickestTransitions
) -> QuickestTransitions:
    """Lower the cost between swaths that join to the extra time of painting both without a break."""
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
) -> tuple[Floats, QuickestTransitions]:
    """Compute seconds (ends, begins) of the quickest transitions, rough for distant pairs; and the transitions.

    Args:
        ends: Ends of swaths, node by node.
        begins: Beginnings of swaths, node by node.
        transitions: Transitions of the method in use.
        segment: (nodes,) number of each node's swath.
        paint_s: (nodes,) painting time (s).
        budget: Reports progress, and may end the search.
    """
    count = len(ends)
    tracks = QuickestTransitions(paint_s, np.full((count, count), -1), *NO_TRANSITIONS)
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
    """Seconds (ends, begins) of straight lines from ends to beginnings, headings ignored."""
    starts, goals = end_rows(ends), end_rows(begins)
    apart = np.hypot(*(goals[None, :, axis] - starts[:, None, axis] for axis in (0, 1)))
    return np.asarray(apart / transitions.limits.transit_speed_mps)


def _rough(
    ends: list[CurveEnd], begins: list[CurveEnd], transitions: TransitionFamily, table: Floats, budget: Budget
) -> None:
    """Fill in rough seconds by the method in use."""
    for part in budget.parts(len(ends), max(ROUGH_PART // len(begins), 1), 0.0, ROUGH_DONE):
        table[part] = pricing_of(transitions).rough_s(transitions, ends[part], begins)


def _nearest(table: Floats, segment: Ints, count: int) -> Ints:
    """Pairs of each end with its cheapest beginnings, and of each beginning with its cheapest ends."""
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
    """Seconds (n,) by the first pass, from one end to all beginnings or from all ends to one beginning."""
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
    """Time pairs until the budget ends it; pairs that differ only in position share one transition.

    Returns:
        Numbers (n,) of the timed `pairs`, seconds (n,) of their quickest transitions, the number (n,) of each one's
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
    """Stack pieces (n, k, 5) and counts (n,) of transitions into one table, as wide as the widest."""
    most = max(pieces.shape[1] for pieces, _ in tables)
    wide = [np.pad(pieces, ((0, 0), (0, most - pieces.shape[1]), (0, 0))) for pieces, _ in tables]
    return np.concatenate(wide), np.concatenate([counts for _, counts in tables])


def _alike(starts: Floats, goals: Floats) -> tuple[Ints, Ints]:
    """Group pairs (rows of both) that differ only in position: first pair of each group, and group of each pair.

    An American football field has one group per ten pairs.
    """
    apart = (goals[:, 0] - starts[:, 0] + 1j * (goals[:, 1] - starts[:, 1])) * np.exp(-1j * starts[:, 2])
    turn = wrapped_all(goals[:, 2] - starts[:, 2])
    seen = np.column_stack((apart.real, apart.imag, turn, starts[:, 3:], goals[:, 3:]))
    grid = np.rint(seen / ALIKE).astype(np.int64)
    _, first, alike = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    return first, alike.reshape(-1)
