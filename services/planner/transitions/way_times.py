"""Compiled: the quickest way from the end of each painted segment to the beginning of each other one, and its time.

For ordering, thousands of ways are timed at once: for each of the turns on offer (tight and slow, wide and fast) the
shortest way, with the clothoids and straights that lead out of and into painted curves, under the limits of the wheels.
"""

import math

import numpy as np

from touchline.services.core.arrays import ascending, copy
from touchline.services.core.jit import kernel
from touchline.services.planner.drives.caps import Caps
from touchline.services.planner.geometry.clothoid import Floats, Ints
from touchline.services.planner.speed.topp import path_time
from touchline.services.planner.steering.circles import LIMIT, TAU
from touchline.services.planner.steering.construct import MAX_PIECES, forward_pieces, put, put_ramp, word_pieces
from touchline.services.planner.steering.dubins_bound import least_plain
from touchline.services.planner.steering.forward import lead_poses
from touchline.services.planner.steering.unit_clothoid import unit

# Columns of an end's row: pose and curvature (1/m) where the turns begin, speed (m/s) on the painted curve; between
# both a clothoid from the painted curvature to 0 (or none: 0) at a sharpness (1/m²), and a straight (m).
X, Y, HEADING, CURVATURE, SPEED, PAINTED, LEAD, PAD = range(8)
# Rounding does not blur more than this (s).
SLACK_S = 1e-9
# A way has no more pieces: those between the leads, and a clothoid and a straight at both ends.
TRACK_PIECES = MAX_PIECES + 4


@kernel
def way_time(
    start: Floats, goal: Floats, c: Floats, root: float, limits: Caps, hops: bool, pieces: Floats
) -> tuple[float, int]:
    """Seconds from one painted end to one painted beginning, with one kind of turn, and how many `pieces` it has.

    `hops`: short hops included.
    """
    seen = complex(goal[X] - start[X], goal[Y] - start[Y]) * unit(-start[HEADING]) * root
    angle = goal[HEADING] - start[HEADING]
    angle -= TAU * math.floor(angle / TAU + 0.5)
    ends = np.empty(2)
    ends[0], ends[1] = start[CURVATURE] / root, goal[CURVATURE] / root
    k = start[PAINTED]
    first = put(pieces, 0, abs(k) / start[LEAD], k, -math.copysign(start[LEAD], k), 1.0)
    first = put(pieces, first, start[PAD], 0.0, 0.0, 1.0)
    way = pieces[first:]
    if hops:
        count = forward_pieces(ends, seen, angle, c, way)
    else:
        between, angle_between = lead_poses(ends, seen, angle)
        count = put_ramp(way, 0, ends[0], 0.0, 1.0)
        count = word_pieces(between.real, between.imag, angle_between, c, way, count)
        count = put_ramp(way, count, 0.0, ends[1], 1.0)
    for i in range(count):
        way[i, 0] /= root
        way[i, 1] *= root
        way[i, 2] *= root * root
    last = put(pieces, first + count, goal[PAD], 0.0, 0.0, 1.0)
    k = goal[PAINTED]
    last = put(pieces, last, abs(k) / goal[LEAD], 0.0, math.copysign(goal[LEAD], k), 1.0)
    return path_time(pieces, last, start[SPEED], goal[SPEED], limits), last


@kernel
def least_time(start: Floats, goal: Floats, curvature: float, limits: Caps) -> float:
    """Seconds: with turns of at most this curvature (1/m), as for `way_time`, no way takes fewer.

    It is as long as the plain Dubins path at least, and driven at best as fast as acceleration and transit speed allow.
    """
    seen = complex(goal[X] - start[X], goal[Y] - start[Y]) * unit(-start[HEADING]) * curvature
    length = least_plain(seen.real, seen.imag, goal[HEADING] - start[HEADING]) / curvature
    for end in (start, goal):
        length += end[PAD] + abs(end[PAINTED]) / end[LEAD]
    first, last, most, gain = start[SPEED], goal[SPEED], limits.transit_mps, limits.acceleration_mps2
    fast: float = math.sqrt(gain * length + 0.5 * (first * first + last * last))
    if fast < max(first, last):
        return float(length / max(first, last))
    fast = min(fast, max(most, first, last))
    rest = length - (2.0 * fast * fast - first * first - last * last) / (2.0 * gain)
    return float((2.0 * fast - first - last) / gain + max(rest, 0.0) / fast)


@kernel
def way_times(
    starts: Floats,
    goals: Floats,
    circles: Floats,
    roots: Floats,
    limits: Caps,
    pairs: Ints,
    hops: bool,
    tracks: Floats,
    counts: Ints,
) -> Floats:
    """Seconds (n,) of the quickest way of every pair (n, 2) of start and goal; fills its pieces and their number.

    `starts` and `goals` are (turns, ends, columns), `circles` (turns, 6) and `roots` (turns,) the square roots of their
    sharpness, `tracks` (n, TRACK_PIECES, 5) and `counts` (n,).
    """
    pieces, seconds = np.zeros((TRACK_PIECES, 5)), np.full(len(pairs), np.inf)
    turns = len(circles)
    words, least, order = np.zeros(turns), np.zeros(turns), np.empty(turns, np.int64)
    for p in range(len(pairs)):
        a, b = pairs[p, 0], pairs[p, 1]
        if hops:
            # Those first whose words are quick: of the others many need not be looked at then.
            for t in range(turns):
                start, goal, curvature = starts[t, a], goals[t, b], circles[t, LIMIT] * roots[t]
                words[t], _ = way_time(start, goal, circles[t], roots[t], limits, False, pieces)
                least[t] = least_time(start, goal, curvature, limits)
        chosen = turns
        ascending(words, order)
        for k in order:
            if least[k] > seconds[p] + SLACK_S:
                continue
            taken, count = way_time(starts[k, a], goals[k, b], circles[k], roots[k], limits, hops, pieces)
            if taken < seconds[p] or (taken == seconds[p] and k < chosen):
                seconds[p], counts[p], chosen = taken, count, int(k)
                for i in range(count):
                    copy(pieces[i], tracks[p, i])
    return seconds
