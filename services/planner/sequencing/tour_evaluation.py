"""Compiled: evaluation of a tour by the crossings of wet paint.

Nodes, tours and matrices are those of search.py. The lines that a transition or a painted segment crosses depend on its
place only, and are found and cached on first use; the order then tells whether they are wet. So evaluating a whole tour
takes microseconds.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.services.planner.geometry.clothoid import Floats, Ints
from touchline.services.planner.sequencing.wet_paint import Contacts, WetLines, wet_crossings

# Sampling of transitions (m); lines are no narrower.
STEP_M = 0.08
UNKNOWN = -1


class Scene(NamedTuple):
    """Ordering problem, with the lines that transitions and painted segments may cross.

    Attributes:
        cost, segment, flip, modes, after: As in search.py.
        paint: (nodes + 1,) painting time of each node (s).
        begins: (nodes + 1, 3) poses (m, m, rad); the last one is the end pose, or nan.
        ends: (nodes, 3) poses.
        kind, pieces, counts: Transitions (see `QuickestTransitions`), straight where unknown.
        over_from, over: Crossings while nodes are painted: rows of segment and number, from `over_from` (nodes + 1,).
        lines: Lines that these rows refer to, as in wet_paint.py, without times.
        owner: (lines,) segment of each line; other robots' lines are numbered after the tour's and the depot.
        others_s: (others,) time at which each of these is half painted (s).
        contacts: Contacts of wheels and casters, with paint that never dries.
        drying: Drying time of the paint (s).
        crossing: Price of a crossing (s).
        run_out: Length of the straight after the last segment, if there is no end pose (m).
    """

    cost: Floats
    segment: Ints
    flip: Ints
    modes: Ints
    after: Ints
    paint: Floats
    begins: Floats
    ends: Floats
    kind: Ints
    pieces: Floats
    counts: Ints
    over_from: Ints
    over: Ints
    lines: WetLines
    owner: Ints
    others_s: Floats
    contacts: Contacts
    drying: float
    crossing: float
    run_out: float


class CrossingCache(NamedTuple):
    """Cache of the crossings of transitions: rows of segment and number from `first` on, closed by −1.

    `used` (1,) counts the rows filled in, `looked_at` (1,) those read to evaluate orders.
    """

    first: NDArray[np.int32]
    rows: NDArray[np.int32]
    used: Ints
    looked_at: Ints


@kernel
def _poses(pieces: Floats, count: int, start: Floats) -> Floats:
    """Poses (n, 4) about STEP_M apart along pieces, at time 0."""
    n = 1
    for k in range(count):
        n += 1 + int(pieces[k, 0] / STEP_M)
    poses = np.zeros((n, 4))
    x, y, heading = start[0], start[1], start[2]
    i = 0
    for k in range(count):
        length, curvature, sharpness, direction = pieces[k, 0], pieces[k, 1], pieces[k, 2], pieces[k, 3]
        heading += pieces[k, 4]
        parts = 1 + int(length / STEP_M)
        h = length / parts
        for _ in range(parts):
            poses[i, 0], poses[i, 1], poses[i, 2] = x, y, heading
            i += 1
            turn = direction * h * (curvature + 0.5 * sharpness * h)
            x += direction * h * math.cos(heading + 0.5 * turn)
            y += direction * h * math.sin(heading + 0.5 * turn)
            heading += turn
            curvature += sharpness * h
    poses[i, 0], poses[i, 1], poses[i, 2] = x, y, heading
    return poses


@kernel
def transition_over(scene: Scene, cache: CrossingCache, a: int, b: int) -> int:
    """First row in the cache of the crossings between two nodes; the rows are filled in if need be.

    Args:
        scene: Ordering problem with its wet paint.
        cache: Crossings found so far.
        a: Node that the transition leaves.
        b: Node that it leads to; the depot stands for the end.
    """
    if cache.first[a, b] != UNKNOWN:
        return int(cache.first[a, b])
    depot = len(scene.paint) - 1
    start = scene.ends[a]
    if b < depot and scene.kind[a, b] >= 0:
        which = scene.kind[a, b]
        poses = _poses(scene.pieces[which], scene.counts[which], start)
    else:
        straight, from_ = np.zeros((1, 5)), start.copy()
        straight[0, 3] = 1.0
        straight[0, 0] = scene.run_out
        if not math.isnan(scene.begins[b, 0]):
            dx, dy = scene.begins[b, 0] - start[0], scene.begins[b, 1] - start[1]
            straight[0, 0], from_[2] = math.hypot(dx, dy), math.atan2(dy, dx)
        poses = _poses(straight, 1, from_)
    counts = wet_crossings(poses, scene.contacts, scene.lines)
    if cache.used[0] + len(counts) + 1 > len(cache.rows):
        # The cache is full: begin again.
        cache.first[:] = UNKNOWN
        cache.used[0] = 0
    first = cache.used[0]
    at = first
    for k in range(len(counts)):
        if counts[k]:
            segment = scene.owner[k]
            if at == first or cache.rows[at - 1, 0] != segment:
                cache.rows[at, 0], cache.rows[at, 1] = segment, 0
                at += 1
            cache.rows[at - 1, 1] += counts[k]
    cache.rows[at, 0] = -1
    cache.used[0] = at + 1
    cache.first[a, b] = first
    return int(first)


class TourEvaluation(NamedTuple):
    """Evaluation of an order.

    Attributes:
        painted: (segments and others,) time at which each segment is half painted (s), infinite if it is not yet; see
            `all_painted`.
        wet: (n,) crossings of wet paint after each position of the tour and on the next segment.
    """

    painted: Floats
    wet: Ints


@kernel
def all_painted(scene: Scene, stops: int) -> Floats:
    """Times at which lines are half painted (s) before a tour of a number of stops: infinite for its own lines."""
    painted = np.full(stops + len(scene.others_s), np.inf)
    for k in range(len(scene.others_s)):
        painted[stops + k] = scene.others_s[k]
    return painted


@kernel
def evaluate(
    scene: Scene, cache: CrossingCache, tour: Ints, span: tuple[int, int], begun: float, evaluation: TourEvaluation
) -> float:
    """Evaluate a stretch of a tour; return the time (s) at which its last segment is done.

    Args:
        scene: Ordering problem with its wet paint.
        cache: Crossings found so far.
        tour: (n,) nodes, the depot first.
        span: Positions (first, last): the transition after each of them and the next segment are evaluated.
        begun: Time at which the segment at the first position is done (s).
        evaluation: Results, filled in for these positions.
    """
    (low, high), painted, wet = span, evaluation.painted, evaluation.wet
    n, depot, time = len(tour), len(scene.paint) - 1, begun
    for i in range(low, high + 1):
        if i + 1 < n:
            painted[scene.segment[tour[i + 1]]] = np.inf
    for i in range(low, high + 1):
        a, b = tour[i], tour[(i + 1) % n]
        between, count = scene.cost[a, b] - scene.paint[b], 0
        if a != depot:
            row, middle = transition_over(scene, cache, a, b), time + 0.5 * between
            while cache.rows[row, 0] >= 0:
                cache.looked_at[0] += 1
                if 0.0 <= middle - painted[cache.rows[row, 0]] <= scene.drying:
                    count += cache.rows[row, 1]
                row += 1
        time += between + scene.paint[b]
        if b != depot:
            middle = time - 0.5 * scene.paint[b]
            cache.looked_at[0] += scene.over_from[b + 1] - scene.over_from[b]
            for row in range(scene.over_from[b], scene.over_from[b + 1]):
                if 0.0 <= middle - painted[scene.over[row, 0]] <= scene.drying:
                    count += scene.over[row, 1]
            painted[scene.segment[b]] = middle
        wet[i] = count
    return time
