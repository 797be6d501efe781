"""Compiled: the order of lanes by simulated annealing, with what neighbours that turn apart leave between them."""

import math

import numpy as np

from touchline.services.core.jit import kernel
from touchline.services.core.random import whole
from touchline.services.planner.geometry.clothoid import Floats, Ints


@kernel
def price(order: Ints, cost: Floats, level: Floats, entry: Floats, pairs: Ints, apart_s: float, turned: Ints) -> float:
    """Seconds for nodes in order (lane k along is 2k, back 2k + 1), and for pairs that turn apart.

    Args:
        order: (n,) nodes.
        cost: (2n, 2n) seconds from the end of one to the beginning of another.
        level: (n,) where each lane lies across the lanes.
        entry: (2n,) seconds to the beginning of each from what comes before the lanes.
        pairs: (p, 3) lane, its upper neighbour, and the end (0: where `along` begins, 1: where it ends).
        apart_s: What it costs where the lower one turns down and the upper one up.
        turned: (n, 2) working space: which way each lane turns at each end.
    """
    total = entry[order[0]]
    turned[:] = 0
    for k in range(len(order) - 1):
        a, b = order[k], order[k + 1]
        total += cost[a, b]
        up = 1 if level[b // 2] > level[a // 2] else -1
        turned[a // 2, 1 - a % 2] = up
        turned[b // 2, b % 2] = -up
    for p in range(len(pairs)):
        if turned[pairs[p, 0], pairs[p, 2]] < 0 and turned[pairs[p, 1], pairs[p, 2]] > 0:
            total += apart_s
    return float(total)


@kernel
def annealed(
    start: Ints,
    cost: Floats,
    level: Floats,
    entry: Floats,
    pairs: Ints,
    apart_s: float,
    steps: int,
    hot_s: float,
    seed: int,
) -> Ints:
    """The best order found; arguments as `price`, with the number of steps, the first temperature (s) and a seed."""
    n = len(start)
    order, trial, best = start.copy(), start.copy(), start.copy()
    turned = np.zeros((n, 2), np.int64)
    now = price(order, cost, level, entry, pairs, apart_s, turned)
    least = now
    for step in range(steps):
        heat = hot_s * (1.0 - step / steps) ** 2 + 1e-3
        trial[:] = order
        at = 8 * step
        i, j = whole(seed, at, n), whole(seed, at + 1, n)
        if i > j:
            i, j = j, i
        move = whole(seed, at + 2, 4)
        if move == 0:
            for k in range(j - i + 1):
                trial[i + k] = order[j - k] ^ 1
        elif move == 1:
            first = order[i]
            for k in range(i, j):
                trial[k] = order[k + 1]
            trial[j] = first ^ whole(seed, at + 3, 2)
        elif move == 2:
            last = order[j]
            for k in range(j, i, -1):
                trial[k] = order[k - 1]
            trial[i] = last ^ whole(seed, at + 3, 2)
        else:
            trial[i], trial[j] = order[j], order[i]
            if (i + j) % 2:
                trial[i] ^= 1
                trial[j] ^= 1
        cost_now = price(trial, cost, level, entry, pairs, apart_s, turned)
        allowed = -heat * math.log((1.0 + whole(seed, at + 4, 1 << 30)) / (1 << 30))
        if cost_now < now + allowed:
            order[:] = trial
            now = cost_now
            if now < least:
                least = now
                best[:] = order
    return best
