"""Compiled: counts the crossings of wet paint of a tour.

Nodes, tours and matrices are those of search.py. What a transition or a painted segment runs over depends on its place
alone, and is found when it is first asked for; whether that is wet then follows from the order. So a whole tour is
evaluated in microseconds.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.services.planner.geometry.clothoid import Floats, Ints
from touchline.services.planner.sequencing.wet import Contacts, WetLines, wet_crossings

# Transitions are sampled this often (m), lines being no narrower.
STEP_M = 0.08
UNKNOWN = -1


class Scene(NamedTuple):
    """An ordering problem with what every transition and every painted segment runs over.

    Attributes:
        cost, segment, flip, modes, after: As in search.py.
        paint: (nodes + 1,) seconds of painting each node.
        begins: (nodes + 1, 3) poses (m, m, rad); the last one is where to stop, or nan.
        ends: (nodes, 3) poses.
        kind, pieces, counts: The transitions (see `Tracks`), straight where unknown.
        over_from, over: What painting a node runs over, from (nodes + 1,) on: rows of segment and times (s).
        lines: The lines that these rows refer to, as in wet.py, without times.
        owner: (lines,) the segment that each line belongs to; behind those of the tour and the depot: others' lines.
        others_s: (others,) when each of these is half painted (s).
        contacts: What touches the ground, with paint that never dries.
        drying: How long paint stays wet (s).
        crossing: Seconds that one crossing may cost.
        run_out: Metres driven straight on behind the last segment, unless there is a place to stop.
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


class Known(NamedTuple):
    """What transitions run over, found once: rows of segment and times from `first` on, closed by −1.

    `used` (1,) counts the rows filled in, `looked_at` (1,) those read to evaluate orders.
    """

    first: NDArray[np.int32]
    rows: NDArray[np.int32]
    used: Ints
    looked_at: Ints


@kernel
def _poses(pieces: Floats, count: int, start: Floats) -> Floats:
    """(n, 4) poses about STEP_M apart along pieces, at time 0."""
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
def transition_over(scene: Scene, known: Known, a: int, b: int) -> int:
    """What is run over between two nodes: the first of its rows in `known`, which are filled in if need be.

    Args:
        scene: What is ordered.
        known: What is run over, as far as it has been looked at.
        a: The node at whose end the robot is.
        b: The node that it drives to; the depot: to the end.
    """
    if known.first[a, b] != UNKNOWN:
        return int(known.first[a, b])
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
    if known.used[0] + len(counts) + 1 > len(known.rows):
        # No more room: begin again.
        known.first[:] = UNKNOWN
        known.used[0] = 0
    first = known.used[0]
    at = first
    for k in range(len(counts)):
        if counts[k]:
            segment = scene.owner[k]
            if at == first or known.rows[at - 1, 0] != segment:
                known.rows[at, 0], known.rows[at, 1] = segment, 0
                at += 1
            known.rows[at - 1, 1] += counts[k]
    known.rows[at, 0] = -1
    known.used[0] = at + 1
    known.first[a, b] = first
    return int(first)


class Judgement(NamedTuple):
    """The evaluation of an order.

    Attributes:
        painted: (segments and others,) when each segment is half painted, s; infinite before it is. See `all_painted`.
        wet: (n,) how often wheels meet wet paint behind each position of the tour and on the next segment.
    """

    painted: Floats
    wet: Ints


@kernel
def all_painted(scene: Scene, stops: int) -> Floats:
    """When each line is half painted (s), before a tour of so many stops: none of its own, all of the other robots'."""
    painted = np.full(stops + len(scene.others_s), np.inf)
    for k in range(len(scene.others_s)):
        painted[stops + k] = scene.others_s[k]
    return painted


@kernel
def judged(scene: Scene, known: Known, tour: Ints, span: tuple[int, int], begun: float, judgement: Judgement) -> float:
    """Evaluate a stretch of a tour; returns when (s) its last segment is done.

    Args:
        scene: What is ordered.
        known: What is run over, as far as it has been looked at.
        tour: (n,) nodes, the depot first.
        span: Positions (first, last): what lies behind each of them, and the segments that follow, are evaluated.
        begun: When the segment at the first position is done (s).
        judgement: Filled in for these.
    """
    (low, high), painted, wet = span, judgement.painted, judgement.wet
    n, depot, time = len(tour), len(scene.paint) - 1, begun
    for i in range(low, high + 1):
        if i + 1 < n:
            painted[scene.segment[tour[i + 1]]] = np.inf
    for i in range(low, high + 1):
        a, b = tour[i], tour[(i + 1) % n]
        between, count = scene.cost[a, b] - scene.paint[b], 0
        if a != depot:
            row, middle = transition_over(scene, known, a, b), time + 0.5 * between
            while known.rows[row, 0] >= 0:
                known.looked_at[0] += 1
                if 0.0 <= middle - painted[known.rows[row, 0]] <= scene.drying:
                    count += known.rows[row, 1]
                row += 1
        time += between + scene.paint[b]
        if b != depot:
            middle = time - 0.5 * scene.paint[b]
            known.looked_at[0] += scene.over_from[b + 1] - scene.over_from[b]
            for row in range(scene.over_from[b], scene.over_from[b + 1]):
                if 0.0 <= middle - painted[scene.over[row, 0]] <= scene.drying:
                    count += scene.over[row, 1]
            painted[scene.segment[b]] = middle
        wet[i] = count
    return time
