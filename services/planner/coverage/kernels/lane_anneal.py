"""Compiled: the order of lanes by simulated annealing, with what neighbours that turn apart leave between them."""

import math
from typing import NamedTuple

import numpy as np

from touchline.core.arrays import copy
from touchline.core.jit import kernel
from touchline.core.random import whole
from touchline.services.planner.geometry.clothoid import Floats, Ints

# Sums of the same seconds in another order differ by less.
ROUNDING_S = 1e-6


class LaneCosts(NamedTuple):
    """What an order of nodes costs: lane k along is 2k, back 2k + 1.

    Attributes:
        way: (2n, 2n) seconds from the end of one to the beginning of another.
        entry: (2n,) seconds to the beginning of each from what comes before the lanes.
        level: (n,) where each lane lies across the lanes.
        pairs: (p, 3) lane, its upper neighbour, and the end (0: where `along` begins, 1: where it ends).
        apart_s: What it costs where the lower one of a pair turns down and the upper one up.
    """

    way: Floats
    entry: Floats
    level: Floats
    pairs: Ints
    apart_s: float


@kernel
def price(order: Ints, costs: LaneCosts, turned: Ints) -> float:
    """Seconds for nodes in order, and for pairs that turn apart.

    Args:
        order: (n,) nodes, one of the two of each lane.
        costs: What they cost.
        turned: (n, 2) filled in: whether the way at each end of a lane leads up (1) or down (−1); 0: there is none.
    """
    total = costs.entry[order[0]]
    turned[:] = 0
    for k in range(len(order) - 1):
        # Nodes are not negative: their lane and way are quicker by shift and mask than by floor and remainder.
        a, b = order[k], order[k + 1]
        first, last = a >> 1, b >> 1
        total += costs.way[a, b]
        up = 1 if costs.level[last] > costs.level[first] else -1
        turned[first, 1 - (a & 1)] = up
        turned[last, b & 1] = -up
    if costs.apart_s == 0.0:
        return float(total)
    pairs = costs.pairs
    for p in range(len(pairs)):
        if turned[pairs[p, 0], pairs[p, 2]] < 0 and turned[pairs[p, 1], pairs[p, 2]] > 0:
            total += costs.apart_s
    return float(total)


@kernel
def add_up(order: Ints, way: Floats, upto: Floats) -> None:
    """Write the seconds for the ways in an order up to each node.

    Args:
        order: (n,) nodes.
        way: (2n, 2n) seconds, as in `LaneCosts`.
        upto: (n,) filled in.
    """
    upto[0] = 0.0
    for k in range(1, len(order)):
        upto[k] = upto[k - 1] + way[order[k - 1], order[k]]


@kernel
def least_price(trial: Ints, costs: LaneCosts, upto: Floats, stretch: Ints) -> float:
    """What `price` of an order is at least, but for rounding, without looking at all of it.

    Args:
        trial: (n,) nodes.
        costs: What they cost.
        upto: (n,) as of `add_up`, of an order that differs in a stretch only.
        stretch: (2,) the first and the last place of it.
    """
    first, last = max(stretch[0], 1), min(stretch[1] + 1, len(trial) - 1)
    total = costs.entry[trial[0]] + upto[first - 1] + upto[-1] - upto[last]
    for k in range(first, last + 1):
        total += costs.way[trial[k - 1], trial[k]]
    return float(total)


@kernel
def moved(order: Ints, trial: Ints, seed: int, at: int, stretch: Ints) -> None:
    """Write a neighbouring order: a stretch turned round, one lane put elsewhere, or two exchanged.

    A stretch turned round is the move of 2-opt (G. A. Croes, "A method for solving traveling-salesman problems",
    Operations Research 6(6), 1958); its lanes are then driven the other way, too.

    Args:
        order: (n,) nodes.
        trial: (n,) filled in.
        seed: Of the random numbers.
        at: The first one of the four that it may take.
        stretch: (2,) filled in: the first and the last place that differ.
    """
    n = len(order)
    copy(order, trial)
    i, j = whole(seed, at, n), whole(seed, at + 1, n)
    if i > j:
        i, j = j, i
    move = whole(seed, at + 2, 4)
    if move == 0:
        for k in range(j - i + 1):
            trial[i + k] = order[j - k] ^ 1
    elif move == 1:
        copy(order[i + 1 : j + 1], trial[i:])
        trial[j] = order[i] ^ whole(seed, at + 3, 2)
    elif move == 2:
        copy(order[i:j], trial[i + 1 :])
        trial[i] = order[j] ^ whole(seed, at + 3, 2)
    else:
        trial[i], trial[j] = order[j], order[i]
        if (i + j) % 2:
            trial[i] ^= 1
            trial[j] ^= 1
    stretch[0], stretch[1] = i, j


@kernel
def annealed(start: Ints, costs: LaneCosts, steps: int, hot_s: float, seed: int) -> Ints:
    """The best order found by simulated annealing.

    Kirkpatrick, Gelatt, Vecchi, "Optimization by Simulated Annealing", Science 220(4598), 1983; a worse order is taken
    with probability exp(−Δ/T). That T falls with the square of the steps left is this project's own choice.

    Args:
        start: (n,) nodes, the order to begin with.
        costs: What they cost.
        steps: How many orders are tried.
        hot_s: The temperature T at first (s).
        seed: Of the random numbers.

    Returns:
        (n,) nodes.
    """
    order, trial, best = start.copy(), start.copy(), start.copy()
    turned, stretch, upto = np.zeros((len(start), 2), np.int64), np.zeros(2, np.int64), np.zeros(len(start))
    add_up(order, costs.way, upto)
    now = price(order, costs, turned)
    least = now
    for step in range(steps):
        heat = hot_s * (1.0 - step / steps) ** 2 + 1e-3
        at = 8 * step
        moved(order, trial, seed, at, stretch)
        allowed = -heat * math.log((1.0 + whole(seed, at + 4, 1 << 30)) / (1 << 30))
        if least_price(trial, costs, upto, stretch) > now + allowed + ROUNDING_S:
            continue
        cost_now = price(trial, costs, turned)
        if cost_now < now + allowed:
            copy(trial, order)
            now = cost_now
            add_up(order, costs.way, upto)
            if now < least:
                least = now
                copy(order, best)
    return best
