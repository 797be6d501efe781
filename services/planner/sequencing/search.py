"""Compiled: iterated local search for order and modes of painted segments.

A node is a segment in one of its modes (direction of travel; for a circle also its beginning). `cost[a, b]` is the cost
of b right after a (to get there and to paint it). The last node is the depot: the start, and the end. A tour is an
array of nodes, the depot first. `flip[a]` is the segment of a painted in the opposite direction.

This is an asymmetric generalised travelling salesman problem: a reversed block is flipped. Prefix sums are kept for
both directions, so that every move is priced in constant time. Moves are 2-opt with flips (Croes, "A method for solving
traveling-salesman problems", Operations Research 6, 1958); or-opt, forward and flipped, of blocks as long as `BLOCK`
(Or, "Traveling salesman-type combinatorial problems and their relation to the logistics of regional blood banking",
1976); and a change of mode. Neighbour lists and the queue of segments are those of Bentley, "Fast algorithms
for geometric traveling salesman problems", ORSA Journal on Computing 4(4), 1992; kicks swap two neighbouring blocks, as
in Martin, Otto and Felten, "Large-step Markov chains for the traveling salesman problem", Complex Systems 5, 1991.
Randomness is counter-based: the k-th kick is the same however the search is divided into runs.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.arrays import copy, least
from touchline.core.jit import borrowing, kernel
from touchline.core.random import whole
from touchline.services.planner.geometry.clothoid import Floats, Ints
from touchline.services.planner.sequencing.blocks import Board, put_behind, reverse, swap

BLOCK = 6
# Maximum number of segments of the blocks that a kick swaps: in general, and for most kicks.
KICK, KICK_NEAR = 50, 10
GAIN = 1e-9
# No move.
NONE = (-1, -1)


class CostTables(NamedTuple):
    """Tables of the search problem.

    Attributes:
        cost: (nodes, nodes) seconds from node to node, painting the second included; the last node is the depot.
        segment: (nodes,) segment that each node paints; the depot is one of its own.
        flip: (nodes,) opposite of each node (itself, if there is none).
        modes: (segments, most modes) nodes of each segment, −1 beyond the last.
        after: (nodes, neighbours) cheapest successors of each node, the cheapest first.
        before: (nodes, neighbours) cheapest predecessors of each node, the cheapest first.
    """

    cost: Floats
    segment: Ints
    flip: Ints
    modes: Ints
    after: Ints
    before: Ints


class Tour(NamedTuple):
    """Tour with the tables that price a move in constant time.

    Attributes:
        board: Board of the tour.
        place: (segments,) position of each segment.
        forth: (n + 1,) cost of the first edges.
        back: (n + 1,) their cost with every block flipped.
    """

    board: Board
    place: Ints
    forth: Floats
    back: Floats


class Queue(NamedTuple):
    """Queue of segments to examine: a ring (n,), and a flag for each segment that is queued."""

    ring: Ints
    queued: NDArray[np.bool_]


class Kicks(NamedTuple):
    """Kicks or moves of a run of a search: number `first` up to, not including, number `last` of `budget`."""

    seed: int
    first: int
    last: int
    budget: int


@kernel
def improve(tables: CostTables, board: Board, best: Ints, lengths: Floats, kicks: Kicks) -> None:
    """Improve a tour in place by kicks, each followed by a descent to a local optimum.

    Args:
        tables: Tables of the problem.
        board: Board of the tour (n,).
        best: (n,) cheapest tour so far, updated.
        lengths: (2,) cost of the tour and of the best one (s), updated.
        kicks: Range of kicks to make.
    """
    tour, segment = board.tour, tables.segment
    n = len(tour)
    state = Tour(board, np.zeros(len(segment), dtype=np.int64), np.zeros(n + 1), np.zeros(n + 1))
    forth = state.forth
    queue = Queue(np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.bool_))
    kept = np.empty(n, dtype=np.int64)
    _index(tables, state, 0, n)
    if kicks.first == 0:
        for i in range(n):
            queue.ring[i], queue.queued[i] = segment[tour[i]], True
        _descend(tables, state, queue, n)
        copy(tour, best)
        lengths[0] = lengths[1] = forth[n]
    if n < 4:
        return
    for k in range(kicks.first, kicks.last):
        copy(tour, kept)
        length = forth[n]
        waiting = _kick(tables, state, queue, kicks.seed, k)
        _descend(tables, state, queue, waiting)
        if forth[n] < lengths[1] - GAIN:
            lengths[1] = forth[n]
            copy(tour, best)
        # To escape local optima, slightly worse tours are accepted, by a decreasing margin.
        slack = 0.02 * (1.0 - k / kicks.budget) * lengths[1] / n
        if forth[n] > length + GAIN and forth[n] > lengths[1] + slack * 4.0:
            low, high = 0, n - 1
            while tour[low] == kept[low]:
                low += 1
            while tour[high] == kept[high]:
                high -= 1
            copy(kept[low : high + 1], tour[low:])
            _index(tables, state, low, high)
    lengths[0] = forth[n]


@borrowing
def _kick(tables: CostTables, state: Tour, queue: Queue, seed: int, k: int) -> int:
    """Swap two random neighbouring blocks; return the number of segments queued then."""
    tour = state.board.tour
    n, waiting = len(tour), 0
    i = 1 + whole(seed, 4 * k, n - 2)
    reach = KICK if k % 4 == 0 else KICK_NEAR
    j = i + 1 + whole(seed, 4 * k + 1, min(reach, n - i - 1))
    e = j + whole(seed, 4 * k + 2, min(reach, n - j)) if j < n else i
    if e < j:
        return waiting
    flips = whole(seed, 4 * k + 3, 4) == 0
    for p in (i - 1, i, j - 1, j, e, (e + 1) % n):
        s = tables.segment[tour[p]]
        if not queue.queued[s]:
            queue.ring[waiting], queue.queued[s] = s, True
            waiting += 1
    swap(state.board, i, j, e, flips)
    _index(tables, state, i, e)
    return waiting


@borrowing
def _index(tables: CostTables, state: Tour, low: int, high: int) -> None:
    """Update positions and prefix sums, forward and flipped, after positions `low` … `high` have changed."""
    cost, flip, segment = tables.cost, tables.flip, tables.segment
    tour, place, forth, back = state.board.tour, state.place, state.forth, state.back
    n = len(tour)
    low = max(low - 1, 0)
    high = min(high, n - 1)
    old_forth, old_back = forth[high + 1], back[high + 1]
    for i in range(low, high + 1):
        place[segment[tour[i]]] = i
        following = tour[i + 1] if i + 1 < n else tour[0]
        forth[i + 1] = forth[i] + cost[tour[i], following]
        back[i + 1] = back[i] + cost[flip[following], flip[tour[i]]]
    old_forth, old_back = forth[high + 1] - old_forth, back[high + 1] - old_back
    for i in range(high + 2, n + 1):
        forth[i] += old_forth
        back[i] += old_back


@borrowing
def _descend(tables: CostTables, state: Tour, queue: Queue, waiting: int) -> None:
    """Make improving moves around the `waiting` queued segments until there is none."""
    tour, segment = state.board.tour, tables.segment
    ring, queued = queue.ring, queue.queued
    n, head = len(tour), 0
    while waiting > 0:
        s = ring[head]
        head, waiting = (head + 1) % n, waiting - 1
        queued[s] = False
        while True:
            low, high = _move(tables, state, s)
            if low < 0:
                break
            _index(tables, state, low, high)
            for p in (low - 1, low, low + 1, high - 1, high, high + 1):
                t = segment[tour[(p + n) % n]]
                if not queued[t] and t != s:
                    ring[(head + waiting) % n], queued[t] = t, True
                    waiting += 1


@borrowing
def _move(tables: CostTables, state: Tour, s: int) -> tuple[int, int]:
    """Make the first improving move at segment `s`; return the range of positions that changed, or −1."""
    cost, flip = tables.cost, tables.flip
    tour, place, forth, back = state.board.tour, state.place, state.forth, state.back
    n, i = len(tour), place[s]
    a, follows, leads = tour[i], tour[(i + 1) % n], tour[i - 1]
    if i > 0 and _other_mode(tables, tour, i, s):
        return i, i
    here = cost[a, follows]
    for b in tables.after[a]:
        if cost[a, b] >= here:
            break
        j = place[tables.segment[b]]
        if j == 0 or j == i:
            continue
        t = tour[j]
        if b == flip[t] and j > i:
            # a, flipped (i+1 … j), j+1
            gain = here + cost[t, tour[(j + 1) % n]] + forth[j] - forth[i + 1]
            gain -= cost[a, b] + cost[flip[follows], tour[(j + 1) % n]] + back[j] - back[i + 1]
            if gain > GAIN:
                reverse(state.board, i + 1, j)
                return i, j
        if b == t or b == flip[t]:
            low, high = _or_opt(tables, state, i, j, b)
            if low >= 0:
                return low, high
    if i == 0:
        return NONE
    here = cost[leads, a]
    for b in tables.before[a]:
        if cost[b, a] >= here:
            break
        j = place[tables.segment[b]]
        if b != flip[tour[j]] or j == 0 or j >= i:
            continue
        # j−1, flipped (j … i−1), a
        gain = here + cost[tour[j - 1], tour[j]] + forth[i - 1] - forth[j]
        gain -= cost[b, a] + cost[tour[j - 1], flip[leads]] + back[i - 1] - back[j]
        if gain > GAIN:
            reverse(state.board, j, i - 1)
            return j, i
    return NONE


@borrowing
def _other_mode(tables: CostTables, tour: Ints, i: int, s: int) -> bool:
    """Paint segment `s`, at position `i`, in another mode, if that gains."""
    cost = tables.cost
    a, follows, leads = tour[i], tour[(i + 1) % len(tour)], tour[i - 1]
    for m in tables.modes[s]:
        if m >= 0 and m != a:
            gain = cost[leads, a] + cost[a, follows] - cost[leads, m] - cost[m, follows]
            if gain > GAIN:
                tour[i] = m
                return True
    return False


@borrowing
def _or_opt(tables: CostTables, state: Tour, i: int, j: int, b: int) -> tuple[int, int]:
    """Move a block that begins with node `b`, at position `j`, to after position `i`, if that gains.

    The block is flipped if `b` is the opposite of the node there. Returns the range of positions that changed, or −1.
    """
    cost, flip = tables.cost, tables.flip
    tour, forth, back = state.board.tour, state.forth, state.back
    n = len(tour)
    a, follows, flips = tour[i], tour[(i + 1) % n], b != tour[j]
    here = cost[a, follows]
    for extra in range(BLOCK):
        first, last = (j - extra, j) if flips else (j, j + extra)
        if first < 1 or last >= n or first <= i <= last:
            break
        if first == i + 1 and not flips:
            break
        if first == i + 1:
            continue
        inner, turned = forth[last] - forth[first], back[last] - back[first]
        lead, trail = tour[first - 1], tour[(last + 1) % n]
        gain = here + cost[lead, tour[first]] + cost[tour[last], trail] - cost[lead, trail] - cost[a, b]
        if flips:
            gain += inner - turned - cost[flip[tour[first]], follows]
        else:
            gain -= cost[tour[last], follows]
        if gain > GAIN and first > i:
            swap(state.board, i + 1, first, last, flips)
            return i, last
        if gain > GAIN:
            put_behind(state.board, first, last + 1, i, flips)
            return first, i
    return NONE


@kernel
def best_modes(cost: Floats, segment: Ints, modes: Ints, tour: Ints) -> Ints:
    """Find the cheapest modes for a tour's order of segments, by dynamic programming over segments.

    Args:
        cost: (nodes, nodes) see `CostTables`.
        segment: (nodes,) see `CostTables`.
        modes: (segments, most modes) see `CostTables`.
        tour: (n,) nodes, the depot first.

    Returns:
        (n,) nodes of the cheapest closed tour through the same segments in the same order.
    """
    n, most = len(tour), modes.shape[1]
    value = np.full((n, most), np.inf)
    chosen = np.zeros((n, most), dtype=np.int64)
    value[0, 0] = 0.0
    for i in range(1, n):
        for m in range(most):
            node = modes[segment[tour[i]], m]
            if node < 0:
                continue
            for p in range(most):
                last = modes[segment[tour[i - 1]], p]
                if last >= 0 and value[i - 1, p] + cost[last, node] < value[i, m]:
                    value[i, m], chosen[i, m] = value[i - 1, p] + cost[last, node], p
    depot = tour[0]
    for m in range(most):
        node = modes[segment[tour[n - 1]], m]
        if node >= 0:
            value[n - 1, m] += cost[node, depot]
    result = np.empty(n, dtype=np.int64)
    m = least(value[n - 1])
    for i in range(n - 1, -1, -1):
        result[i] = modes[segment[tour[i]], m]
        m = chosen[i, m]
    return result


@borrowing
def tour_cost(cost: Floats, tour: Ints) -> float:
    """Seconds of the closed tour (n,) over a matrix (nodes, nodes)."""
    total = 0.0
    for i in range(len(tour)):
        total += cost[tour[i], tour[(i + 1) % len(tour)]]
    return total
