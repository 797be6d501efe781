"""Compiled: the quickest way from the end of each painted segment to the beginning of each other one, and its time.

For ordering, thousands of ways are timed at once: for each of the turns on offer (tight and slow, wide and fast) the
shortest way, with the clothoids and straights that lead out of and into painted curves, under the limits of the wheels.
"""

import math

import numpy as np

from schemas.jit import kernel
from services.planner.clothoid import Floats
from services.planner.order_search import Ints
from services.planner.passes import path_time
from services.planner.steering.circles import TAU
from services.planner.steering.construct import MAX_PIECES, forward_pieces, put, put_ramp, word_pieces
from services.planner.steering.forward import lead_poses
from services.planner.steering.spiral import unit

# Columns of an end's row: pose and curvature (1/m) where the turns begin, speed (m/s) on the painted curve; between
# both a clothoid from the painted curvature to 0 (or none: 0) at a sharpness (1/m²), and a straight (m).
X, Y, HEADING, CURVATURE, SPEED, PAINTED, LEAD, PAD = range(8)


# A way has no more pieces: those between the leads, and a clothoid and a straight at both ends.
TRACK_PIECES = MAX_PIECES + 4


@kernel
def way_time(
    start: Floats, goal: Floats, c: Floats, root: float, limits: Floats, hops: bool, pieces: Floats
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
def way_times(
    starts: Floats,
    goals: Floats,
    circles: Floats,
    roots: Floats,
    limits: Floats,
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
    for p in range(len(pairs)):
        for k in range(len(circles)):
            start, goal = starts[k, pairs[p, 0]], goals[k, pairs[p, 1]]
            taken, count = way_time(start, goal, circles[k], roots[k], limits, hops, pieces)
            if taken < seconds[p]:
                seconds[p], counts[p] = taken, count
                tracks[p] = pieces
    return seconds
