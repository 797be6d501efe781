"""Compiled: iterated local search for the order and the modes of painted segments.

A node is a segment in one of its modes (direction of travel; for a circle also where it begins). `cost[a, b]` is what
b costs right after a (to get there and to paint it). The last node is the depot: the start, and the end. A tour is an
array of nodes, the depot first. `flip[a]` is the segment of a painted the other way round.

The matrix is asymmetric and a reversed block is flipped, so prefix sums are kept for both ways: every move is priced
in constant time. Moves: 2-opt with flips; or-opt, forward and flipped, of blocks as long as `BLOCK`; a change of mode.
Randomness is counter-based: the k-th kick is the same however the search is cut into runs.
"""

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.arrays import copy, least
from touchline.services.core.jit import kernel
from touchline.services.planner.geometry.clothoid import Floats, Ints

BLOCK = 6
# Kicks swap two neighbouring blocks of at most this many segments; most of them smaller ones.
KICK, KICK_NEAR = 50, 10
GAIN = 1e-9


@kernel
def improve(
    cost: Floats,
    flip: Ints,
    segment: Ints,
    modes: Ints,
    after: Ints,
    before: Ints,
    tour: Ints,
    best: Ints,
    lengths: Floats,
    seed: int,
    first: int,
    count: int,
    budget: int,
) -> None:
    """Kicks number `first` to `first + count` of `budget`, in place: `tour`, `best` and their `lengths` (2,).

    `modes` (segments, most modes) lists the nodes of each segment, −1 beyond the last; `after` and `before` (nodes,
    neighbours) each node's cheapest successors and predecessors.
    """
    n = len(tour)
    forth, back = np.zeros(n + 1), np.zeros(n + 1)
    place = np.zeros(len(segment), dtype=np.int64)
    queue, queued = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.bool_)
    scratch, kept = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    _index(cost, flip, segment, tour, place, forth, back, 0, n)
    if first == 0:
        for i in range(n):
            queue[i], queued[i] = segment[tour[i]], True
        _descend(cost, flip, segment, modes, after, before, tour, place, forth, back, queue, queued, n, scratch)
        copy(tour, best)
        lengths[0] = lengths[1] = forth[n]
    if n < 4:
        return
    for k in range(first, first + count):
        copy(tour, kept)
        length = forth[n]
        i = 1 + random(seed, 4 * k, n - 2)
        reach = KICK if k % 4 == 0 else KICK_NEAR
        j = i + 1 + random(seed, 4 * k + 1, min(reach, n - i - 1))
        e = j + random(seed, 4 * k + 2, min(reach, n - j)) if j < n else i
        waiting = 0
        if e >= j:
            flips = random(seed, 4 * k + 3, 4) == 0
            ends = (i - 1, i, j - 1, j, e, (e + 1) % n)
            for p in ends:
                s = segment[tour[p]]
                if not queued[s]:
                    queue[waiting], queued[s] = s, True
                    waiting += 1
            swap(tour, flip, i, j, e, flips, scratch)
            _index(cost, flip, segment, tour, place, forth, back, i, e)
        _descend(cost, flip, segment, modes, after, before, tour, place, forth, back, queue, queued, waiting, scratch)
        if forth[n] < lengths[1] - GAIN:
            lengths[1] = forth[n]
            copy(tour, best)
        # A little worse is accepted, less and less of it: a local optimum's way out.
        slack = 0.02 * (1.0 - k / budget) * lengths[1] / n
        if forth[n] > length + GAIN and forth[n] > lengths[1] + slack * 4.0:
            low, high = 0, n - 1
            while tour[low] == kept[low]:
                low += 1
            while tour[high] == kept[high]:
                high -= 1
            copy(kept[low : high + 1], tour[low:])
            _index(cost, flip, segment, tour, place, forth, back, low, high)
    lengths[0] = forth[n]


@kernel
def random(seed: int, counter: int, below: int) -> int:
    """A whole number in 0 … below − 1 (SplitMix64 of the counter)."""
    z = np.uint64(seed) + np.uint64(counter + 1) * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return int((z >> np.uint64(11)) % np.uint64(max(below, 1)))


@kernel
def _index(
    cost: Floats, flip: Ints, segment: Ints, tour: Ints, place: Ints, forth: Floats, back: Floats, low: int, high: int
) -> None:
    """Where each segment is, and what the first edges cost forth and flipped, after `low` … `high` have changed."""
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


@kernel
def swap(tour: Ints, flip: Ints, i: int, j: int, e: int, flips: bool, scratch: Ints) -> None:
    """Put the block j…e before the block i…j−1, flipped or not."""
    moved = e - j + 1
    for k in range(moved):
        scratch[k] = flip[tour[e - k]] if flips else tour[j + k]
    for k in range(j - 1, i - 1, -1):
        tour[k + moved] = tour[k]
    copy(scratch[:moved], tour[i:])


@kernel
def put_behind(tour: Ints, flip: Ints, i: int, j: int, e: int, flips: bool, scratch: Ints) -> None:
    """Put the block i…j−1 behind the block j…e, flipped or not."""
    moved = j - i
    for k in range(moved):
        scratch[k] = flip[tour[j - 1 - k]] if flips else tour[i + k]
    for k in range(j, e + 1):
        tour[k - moved] = tour[k]
    copy(scratch[:moved], tour[e - moved + 1 :])


@kernel
def reverse(tour: Ints, flip: Ints, i: int, j: int) -> None:
    """Turn the block i…j round."""
    while i < j:
        tour[i], tour[j] = flip[tour[j]], flip[tour[i]]
        i += 1
        j -= 1
    if i == j:
        tour[i] = flip[tour[i]]


@kernel
def _descend(
    cost: Floats,
    flip: Ints,
    segment: Ints,
    modes: Ints,
    after: Ints,
    before: Ints,
    tour: Ints,
    place: Ints,
    forth: Floats,
    back: Floats,
    queue: Ints,
    queued: NDArray[np.bool_],
    waiting: int,
    scratch: Ints,
) -> None:
    """Take improving moves round the `waiting` queued segments until there is none."""
    n, head = len(tour), 0
    while waiting > 0:
        s = queue[head]
        head, waiting = (head + 1) % n, waiting - 1
        queued[s] = False
        while True:
            low, high = _move(cost, flip, segment, modes, after, before, tour, place, forth, back, s, scratch)
            if low < 0:
                break
            _index(cost, flip, segment, tour, place, forth, back, low, high)
            for p in (low - 1, low, low + 1, high - 1, high, high + 1):
                t = segment[tour[(p + n) % n]]
                if not queued[t] and t != s:
                    queue[(head + waiting) % n], queued[t] = t, True
                    waiting += 1


@kernel
def _move(
    cost: Floats,
    flip: Ints,
    segment: Ints,
    modes: Ints,
    after: Ints,
    before: Ints,
    tour: Ints,
    place: Ints,
    forth: Floats,
    back: Floats,
    s: int,
    scratch: Ints,
) -> tuple[int, int]:
    """Take the first improving move at segment `s`; the positions between which the tour changed, or −1."""
    n, i = len(tour), place[s]
    a = tour[i]
    follows = tour[(i + 1) % n]
    leads = tour[i - 1]
    if i > 0:
        for m in modes[s]:
            if m >= 0 and m != a:
                gain = cost[leads, a] + cost[a, follows] - cost[leads, m] - cost[m, follows]
                if gain > GAIN:
                    tour[i] = m
                    return i, i
    here = cost[a, follows]
    for b in after[a]:
        if cost[a, b] >= here:
            break
        j = place[segment[b]]
        if j == 0 or j == i:
            continue
        t = tour[j]
        if b == flip[t] and j > i:
            # a, flipped (i+1 … j), j+1
            gain = here + cost[t, tour[(j + 1) % n]] + forth[j] - forth[i + 1]
            gain -= cost[a, b] + cost[flip[follows], tour[(j + 1) % n]] + back[j] - back[i + 1]
            if gain > GAIN:
                reverse(tour, flip, i + 1, j)
                return i, j
        if b == t or b == flip[t]:
            flips = b != t
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
                if gain > GAIN:
                    if first > i:
                        swap(tour, flip, i + 1, first, last, flips, scratch)
                        return i, last
                    put_behind(tour, flip, first, last + 1, i, flips, scratch)
                    return first, i
    if i == 0:
        return -1, -1
    here = cost[leads, a]
    for b in before[a]:
        if cost[b, a] >= here:
            break
        j = place[segment[b]]
        if b != flip[tour[j]] or j == 0 or j >= i:
            continue
        # j−1, flipped (j … i−1), a
        gain = here + cost[tour[j - 1], tour[j]] + forth[i - 1] - forth[j]
        gain -= cost[b, a] + cost[tour[j - 1], flip[leads]] + back[i - 1] - back[j]
        if gain > GAIN:
            reverse(tour, flip, j, i - 1)
            return j, i
    return -1, -1


@kernel
def best_modes(cost: Floats, segment: Ints, modes: Ints, tour: Ints) -> Ints:
    """The cheapest modes for the tour's order of segments (dynamic programming)."""
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


@kernel
def tour_cost(cost: Floats, tour: Ints) -> float:
    """Cost of the closed tour."""
    total = 0.0
    for i in range(len(tour)):
        total += cost[tour[i], tour[(i + 1) % len(tour)]]
    return total
