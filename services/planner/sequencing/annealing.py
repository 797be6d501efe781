"""Compiled: simulated annealing of order and modes, by time and crossings of wet paint.

Metropolis' rule with geometric cooling, after Kirkpatrick, Gelatt and Vecchi, "Optimization by simulated annealing",
Science 220, 1983. Every move is evaluated with all its consequences (see tour_evaluation.py).
"""

import math
from typing import NamedTuple

import numpy as np

from touchline.core.arrays import copy
from touchline.core.jit import borrowing, kernel
from touchline.core.random import whole
from touchline.services.planner.geometry.clothoid import Floats, Ints
from touchline.services.planner.sequencing.blocks import Board, put_behind, reverse, swap
from touchline.services.planner.sequencing.search import GAIN, Kicks
from touchline.services.planner.sequencing.tour_evaluation import (
    CrossingCache,
    Scene,
    TourEvaluation,
    all_painted,
    evaluate,
)

# Maximum number of segments of a moved block: usually, and now and then (and if it is reversed).
BLOCK, TURNED = 8, 30
# Crossings that a single move may be credited with.
FEWER = 12
# Final temperature (s).
COLD_S = 0.05


class Incumbents(NamedTuple):
    """Annealed tour and the best one so far, changed in place.

    Attributes:
        tour: (n,) nodes, the depot first.
        best: (n,) nodes of the cheapest tour so far.
        costs: (2,) seconds of both, crossings included at their price; infinite before the first run.
    """

    tour: Ints
    best: Ints
    costs: Floats


@kernel
def anneal(scene: Scene, cache: CrossingCache, found: Incumbents, moves: Kicks, hot_s: float) -> None:
    """Anneal a tour in place by a run of moves.

    Within one call, the small delays that a move causes for later segments are neglected.

    Args:
        scene: Ordering problem with its wet paint.
        cache: Crossings found so far.
        found: Current tour and the best one.
        moves: Range of moves to make.
        hot_s: Initial temperature (s).
    """
    tour, best, costs = found.tour, found.best, found.costs
    n = len(tour)
    place, trial = np.zeros(len(scene.segment), np.int64), tour.copy()
    board = Board(trial, scene.flip, np.empty(n, np.int64))
    painted, tried = all_painted(scene, n), np.empty(n)
    wet, trial_wet = np.zeros(n, np.int64), np.zeros(n, np.int64)
    for i in range(n):
        place[scene.segment[tour[i]]] = i
    total = evaluate(scene, cache, tour, (0, n - 1), 0.0, TourEvaluation(painted, wet))
    costs[0] = total + scene.crossing * _count(wet, 0, n - 1)
    if costs[0] < costs[1]:
        costs[1] = costs[0]
        copy(tour, best)
    if n < 3:
        return
    for k in range(moves.first, moves.last):
        heat = hot_s * (COLD_S / hot_s) ** (k / moves.budget)
        low, high = _propose(scene, tour, board, place, moves.seed, 8 * k)
        if low < 0:
            continue
        low, high = max(low - 1, 0), min(high, n - 1)
        slower = _seconds(scene.cost, trial, low, high) - _seconds(scene.cost, tour, low, high)
        allowed = -heat * math.log((1.0 + whole(moves.seed, 8 * k + 7, 1 << 30)) / (1 << 30))
        wetter = -_count(wet, low, high)
        # A move that removes many crossings seldom takes much longer, so the credit is capped.
        taken = slower + scene.crossing * max(wetter, -FEWER) <= allowed
        if taken:
            done = 0.0
            if low > 0:
                done = painted[scene.segment[tour[low]]] + 0.5 * scene.paint[tour[low]]
            for i in range(low, min(high + 2, n)):
                tried[i] = painted[scene.segment[tour[i]]]
            evaluate(scene, cache, trial, (low, high), done, TourEvaluation(painted, trial_wet))
            wetter += _count(trial_wet, low, high)
            taken = slower + scene.crossing * wetter <= allowed
            if not taken:
                for i in range(low, min(high + 2, n)):
                    painted[scene.segment[tour[i]]] = tried[i]
        if not taken:
            copy(tour[low : high + 1], trial[low:])
            continue
        copy(trial[low : high + 1], tour[low:])
        copy(trial_wet[low : high + 1], wet[low:])
        for i in range(low, high + 1):
            place[scene.segment[tour[i]]] = i
        costs[0] += slower + scene.crossing * wetter
        if costs[0] < costs[1] - GAIN:
            costs[1] = costs[0]
            copy(tour, best)


@borrowing
def _count(wet: Ints, low: int, high: int) -> int:
    """Number of crossings from position `low` to position `high`."""
    count = 0
    for i in range(low, high + 1):
        count += wet[i]
    return count


@borrowing
def _seconds(cost: Floats, tour: Ints, low: int, high: int) -> float:
    """Seconds of the edges from position `low` to after position `high`."""
    n, total = len(tour), 0.0
    for i in range(low, high + 1):
        total += cost[tour[i], tour[(i + 1) % n]]
    return total


@borrowing
def _block(seed: int, at: int) -> int:
    """Random number of segments of a block, less one."""
    size = whole(seed, at, 4 * TURNED)
    return int(size // 4 if size % 4 == 0 else size % BLOCK)


@borrowing
def _propose(scene: Scene, tour: Ints, board: Board, place: Ints, seed: int, at: int) -> tuple[int, int]:
    """Change the board's tour from `tour` by one move; return the range of positions that differ, or −1."""
    n, flip, trial = len(tour), scene.flip, board.tour
    what = whole(seed, at, 8)
    if what == 0:
        i = 1 + whole(seed, at + 1, n - 1)
        choice = scene.modes[scene.segment[tour[i]]]
        m = choice[whole(seed, at + 2, len(choice))]
        if m < 0 or m == tour[i]:
            return -1, -1
        trial[i] = m
        return i, i
    if what == 1:
        i = 1 + whole(seed, at + 1, n - 1)
        j = min(i + 1 + whole(seed, at + 2, TURNED), n - 1)
        reverse(board, i, j)
        return i, j
    flips = whole(seed, at + 3, 2) == 0
    if what <= 3:
        # A block changes places with its neighbour.
        i = 1 + whole(seed, at + 1, n - 1)
        j = i + 1 + whole(seed, at + 2, TURNED)
        e = j + _block(seed, at + 4)
        if e >= n:
            return -1, -1
        if what == 2:
            swap(board, i, j, e, flips)
        else:
            back = min(i + _block(seed, at + 4), j - 1)
            put_behind(board, i, back + 1, j, flips)
            return i, j
        return i, e
    # A near successor is moved after a segment, with the block that follows it, or with the reversed block before it.
    i = whole(seed, at + 1, n)
    b = scene.after[tour[i], whole(seed, at + 2, scene.after.shape[1])]
    j = place[scene.segment[b]]
    if j == 0 or j == i:
        return -1, -1
    if b != tour[j] and b != flip[tour[j]]:
        trial[j] = b
    flips = b == flip[tour[j]] and b != tour[j]
    if flips and j > i and what <= 5:
        reverse(board, i + 1, j)
        return i + 1, j
    extra = _block(seed, at + 4)
    first, last = (j - extra, j) if flips else (j, j + extra)
    if first < 1 or last >= n or first <= i <= last or (first == i + 1 and not flips):
        trial[j] = tour[j]
        return -1, -1
    if first > i + 1:
        swap(board, i + 1, first, last, flips)
        return i + 1, last
    if first == i + 1:
        reverse(board, first, last)
        return first, last
    put_behind(board, first, last + 1, i, flips)
    return first, i
