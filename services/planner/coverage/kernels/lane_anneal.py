"""Compiled: order of lanes by simulated annealing, with a price for neighbours that turn apart."""

import math
from typing import NamedTuple

import numpy as np

from touchline.core.arrays import copy
from touchline.core.jit import kernel
from touchline.core.random import whole
from touchline.services.planner.geometry.clothoid import Floats, Ints

# Rounding (s) between sums of the same seconds in different orders.
ROUNDING_S = 1e-6


class LaneCosts(NamedTuple):
    """Costs of an order of nodes; lane k is node 2k along, 2k + 1 back.

    Attributes:
        transition: (2n, 2n) seconds from the end of one to the beginning of another.
        entry: (2n,) seconds to the beginning of each from before the lanes.
        level: (n,) position of each lane across the lanes (m).
        pairs: (p, 3) lane, its upper neighbour, and the end (0: where `along` begins, 1: where it ends).
        apart_s: Price where the lower one of a pair turns down and the upper one up (s).
    """

    transition: Floats
    entry: Floats
    level: Floats
    pairs: Ints
    apart_s: float


@kernel
def price(order: Ints, costs: LaneCosts, turned: Ints) -> float:
    """Seconds for nodes in order, and for pairs that turn apart.

    Args:
        order: (n,) nodes, one of the two of each lane.
        costs: Costs of the nodes.
        turned: (n, 2) filled in: direction of the transition at each end of a lane, 1 up, −1 down, 0 none.
    """
    total = costs.entry[order[0]]
    turned[:] = 0
    for k in range(len(order) - 1):
        # Nodes are not negative: shift and mask give lane and direction faster than floor and remainder.
        a, b = order[k], order[k + 1]
        first, last = a >> 1, b >> 1
        total += costs.transition[a, b]
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
def add_up(order: Ints, transition: Floats, upto: Floats) -> None:
    """Write the accumulated seconds of the transitions up to each node.

    Args:
        order: (n,) nodes.
        transition: (2n, 2n) seconds, as in `LaneCosts`.
        upto: (n,) filled in.
    """
    upto[0] = 0.0
    for k in range(1, len(order)):
        upto[k] = upto[k - 1] + transition[order[k - 1], order[k]]


@kernel
def least_price(trial: Ints, costs: LaneCosts, upto: Floats, stretch: Ints) -> float:
    """Lower bound of `price` of an order, but for rounding, from a changed stretch only.

    Args:
        trial: (n,) nodes.
        costs: Costs of the nodes.
        upto: (n,) from `add_up`, of an order that differs in the stretch only.
        stretch: (2,) first and last index of the stretch.
    """
    first, last = max(stretch[0], 1), min(stretch[1] + 1, len(trial) - 1)
    total = costs.entry[trial[0]] + upto[first - 1] + upto[-1] - upto[last]
    for k in range(first, last + 1):
        total += costs.transition[trial[k - 1], trial[k]]
    return float(total)


@kernel
def moved(order: Ints, trial: Ints, seed: int, at: int, stretch: Ints) -> None:
    """Write a neighbouring order: a stretch reversed, one lane moved, or two exchanged.

    Reversing a stretch is the move of 2-opt (G. A. Croes, "A method for solving traveling-salesman problems",
    Operations Research 6(6), 1958); its lanes are then driven in the opposite direction, too.

    Args:
        order: (n,) nodes.
        trial: (n,) filled in.
        seed: Seed of the random numbers.
        at: Index of the first of the four random numbers that it may take.
        stretch: (2,) filled in: first and last index that differ.
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
    """Find an order by simulated annealing.

    Kirkpatrick, Gelatt, Vecchi, "Optimization by Simulated Annealing", Science 220(4598), 1983; a worse order is taken
    with probability exp(−Δ/T). That T falls with the square of the remaining steps is this project's own choice.

    Args:
        start: (n,) nodes in the initial order.
        costs: Costs of the nodes.
        steps: Number of orders that are tried.
        hot_s: Initial temperature T (s).
        seed: Seed of the random numbers.

    Returns:
        (n,) nodes.
    """
    order, trial, best = start.copy(), start.copy(), start.copy()
    turned, stretch, upto = np.zeros((len(start), 2), np.int64), np.zeros(2, np.int64), np.zeros(len(start))
    add_up(order, costs.transition, upto)
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
            add_up(order, costs.transition, upto)
            if now < least:
                least = now
                copy(order, best)
    return best
