"""Compiled: quickest transition of each pair of a painted end and a painted beginning, and its time.

For ordering, thousands of transitions are timed at once: the shortest one for each of the turns on offer (tight and
slow, wide and fast), with the clothoids and straights out of and into painted curves, within the limits of the drive.
"""

import math
from typing import NamedTuple

import numpy as np

from touchline.core.angles import nearest_turn
from touchline.core.arcs import unit
from touchline.core.arrays import ascending, copy
from touchline.core.jit import kernel
from touchline.services.planner.drives.caps import Caps
from touchline.services.planner.geometry.clothoid import Floats, Ints
from touchline.services.planner.speed.topp import path_time
from touchline.services.planner.steering.circles import LIMIT
from touchline.services.planner.steering.construct import MAX_PIECES, forward_pieces, put, put_ramp, word_pieces
from touchline.services.planner.steering.dubins_bound import least_plain
from touchline.services.planner.steering.forward import lead_poses
from touchline.services.planner.steering.query import Query
from touchline.services.planner.transitions.piece_table import PieceTable

# Columns of an end's row: pose and curvature (1/m) where the turns begin, speed (m/s) on the painted curve; in between
# a clothoid from the painted curvature to 0 (or none: 0) at a sharpness (1/m²), and a straight (m).
X, Y, HEADING, CURVATURE, SPEED, PAINTED, LEAD, PAD = range(8)
# Rounding of times (s).
SLACK_S = 1e-9
# Maximum number of pieces: those between the leads, and a clothoid and a straight at both ends.
TRACK_PIECES = MAX_PIECES + 4


class TurnFigures(NamedTuple):
    """Kind of turn: dimensions (6,) of its circle (see circles.py), and the square root of its sharpness."""

    circle: Floats
    root: float


class TurnRows(NamedTuple):
    """Ends and beginnings for every kind of turn.

    Attributes:
        starts: (turns, ends, columns) beginnings of turns.
        goals: (turns, beginnings, columns) ends of turns.
        circles: (turns, 6) dimensions of the turning circles.
        roots: (turns,) square roots of their sharpness.
    """

    starts: Floats
    goals: Floats
    circles: Floats
    roots: Floats


@kernel
def transition_time(
    start: Floats, goal: Floats, turning: TurnFigures, limits: Caps, hops: bool, pieces: Floats
) -> tuple[float, int]:
    """Seconds and number of pieces from a painted end to a painted beginning with one kind of turn.

    Args:
        start: (columns,) row of the end.
        goal: (columns,) row of the beginning.
        turning: Kind of turn.
        limits: Limits of drive and plan.
        hops: Whether short hops are included.
        pieces: (TRACK_PIECES, 5) filled in.
    """
    c, root = turning.circle, turning.root
    seen = complex(goal[X] - start[X], goal[Y] - start[Y]) * unit(-start[HEADING]) * root
    angle = nearest_turn(goal[HEADING] - start[HEADING], 0.0)
    ends = np.empty(2)
    ends[0], ends[1] = start[CURVATURE] / root, goal[CURVATURE] / root
    k = start[PAINTED]
    first = put(pieces, 0, abs(k) / start[LEAD], k, -math.copysign(start[LEAD], k), 1.0)
    first = put(pieces, first, start[PAD], 0.0, 0.0, 1.0)
    transition = pieces[first:]
    if hops:
        count = forward_pieces(Query(ends, seen, angle, c), transition)
    else:
        between, angle_between = lead_poses(ends, seen, angle)
        count = put_ramp(transition, 0, ends[0], 0.0, 1.0)
        count = word_pieces(between.real, between.imag, angle_between, c, transition, count)
        count = put_ramp(transition, count, 0.0, ends[1], 1.0)
    for i in range(count):
        transition[i, 0] /= root
        transition[i, 1] *= root
        transition[i, 2] *= root * root
    last = put(pieces, first + count, goal[PAD], 0.0, 0.0, 1.0)
    k = goal[PAINTED]
    last = put(pieces, last, abs(k) / goal[LEAD], 0.0, math.copysign(goal[LEAD], k), 1.0)
    return path_time(pieces, last, start[SPEED], goal[SPEED], limits), last


@kernel
def least_time(start: Floats, goal: Floats, curvature: float, limits: Caps) -> float:
    """Lower bound on `transition_time` (s) for turns of at most a curvature.

    A transition is no shorter than the plain Dubins path and no faster than acceleration and transit speed allow.

    Args:
        start: (columns,) row of the end.
        goal: (columns,) row of the beginning.
        curvature: Maximum curvature of the turns (1/m).
        limits: Limits of drive and plan.
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
def transition_times(rows: TurnRows, limits: Caps, pairs: Ints, hops: bool, found: PieceTable) -> Floats:
    """Compute seconds (n,) of the quickest transition of every pair (n, 2) of start and goal, and its pieces.

    Args:
        rows: Ends and beginnings.
        limits: Limits of drive and plan.
        pairs: (n, 2) numbers of an end and a beginning.
        hops: Whether short hops are included.
        found: Table of n transitions of up to TRACK_PIECES, filled in.
    """
    pieces, seconds = np.zeros((TRACK_PIECES, 5)), np.full(len(pairs), np.inf)
    turns = len(rows.circles)
    words, least, order = np.zeros(turns), np.zeros(turns), np.empty(turns, np.int64)
    for p in range(len(pairs)):
        a, b = pairs[p, 0], pairs[p, 1]
        if hops:
            # Quick words first: many of the others are skipped then.
            for t in range(turns):
                start, goal, turning = rows.starts[t, a], rows.goals[t, b], TurnFigures(rows.circles[t], rows.roots[t])
                words[t], _ = transition_time(start, goal, turning, limits, False, pieces)
                least[t] = least_time(start, goal, turning.circle[LIMIT] * turning.root, limits)
        chosen = turns
        ascending(words, order)
        for k in order:
            if least[k] > seconds[p] + SLACK_S:
                continue
            turning = TurnFigures(rows.circles[k], rows.roots[k])
            taken, count = transition_time(rows.starts[k, a], rows.goals[k, b], turning, limits, hops, pieces)
            if taken < seconds[p] or (taken == seconds[p] and k < chosen):
                seconds[p], found.counts[p], chosen = taken, count, int(k)
                for i in range(count):
                    copy(pieces[i], found.pieces[p, i])
    return seconds
