"""Compiled: how long the quickest way takes from the end of each painted segment to the beginning of each other one.

For ordering, thousands of ways are timed at once: for each of the turns on offer (tight and slow, wide and fast) the
shortest way, with the clothoids and straights that lead out of and into painted curves, under the limits of the wheels.
"""

import math

import numpy as np

from schemas.jit import kernel
from services.planner.clothoid import Floats
from services.planner.order_search import Ints
from services.planner.passes import path_time
from services.planner.steering.circles import LIMIT, LIMIT_TURN, turn_length, word_table
from services.planner.steering.forward import WORDS, shortest_forward, three_elements
from services.planner.steering.profile import shape
from services.planner.steering.spiral import ramp, unit

# Columns of an end's row: pose and curvature (1/m) where the turns begin, speed (m/s) on the painted curve; between
# both a clothoid from the painted curvature to 0 (or none: 0) at a sharpness (1/m²), and a straight (m).
X, Y, HEADING, CURVATURE, SPEED, PAINTED, LEAD, PAD = range(8)
COLUMNS = 8
PIECES_MAX = 20
TAU = 2.0 * math.pi


@kernel
def _remainder(angle: float) -> float:
    return angle - TAU * math.floor(angle / TAU + 0.5)


@kernel
def _add(pieces: Floats, count: int, length: float, curvature: float, sharpness: float) -> int:
    if length <= 0.0:
        return count
    pieces[count, 0], pieces[count, 1], pieces[count, 2] = length, curvature, sharpness
    return count + 1


@kernel
def _add_ramp(pieces: Floats, count: int, k_from: float, k_to: float, root: float) -> int:
    """The clothoid between two curvatures in units of unit sharpness."""
    slope = math.copysign(root * root, k_to - k_from)
    return _add(pieces, count, abs(k_to - k_from) / root, k_from * root, slope)


@kernel
def _add_turn(pieces: Floats, count: int, deflection: float, c: Floats, root: float) -> int:
    """The turn by a signed deflection."""
    size, side = abs(deflection), math.copysign(1.0, deflection)
    if size >= c[LIMIT_TURN]:
        count = _add_ramp(pieces, count, 0.0, side * c[LIMIT], root)
        count = _add(pieces, count, (size - c[LIMIT_TURN]) / c[LIMIT] / root, side * c[LIMIT] * root, 0.0)
        return _add_ramp(pieces, count, side * c[LIMIT], 0.0, root)
    half = 0.5 * turn_length(size, c) / root
    top = side * size / half
    count = _add(pieces, count, half, 0.0, top / half)
    return _add(pieces, count, half, top, -top / half)


@kernel
def _add_word(pieces: Floats, count: int, ends: Floats, goal: complex, turn: float, c: Floats, root: float) -> int:
    """The shortest of the six words, with ramps to and from straight."""
    to_straight, out_turn = ramp(0.0, ends[0], 0.0)
    from_straight, in_turn = ramp(0.0, 0.0, ends[1])
    between = (goal - unit(turn - in_turn) * from_straight - to_straight) * unit(-out_turn)
    heading = turn - in_turn - out_turn
    count = _add_ramp(pieces, count, ends[0], 0.0, root)
    if abs(between.imag) <= 1e-9 and between.real >= 0.0 and abs(_remainder(heading)) <= 1e-9:
        count = _add(pieces, count, between.real / root, 0.0, 0.0)
    else:
        table = np.empty((8, 3))
        word_table(between.real, between.imag, heading, c, table)
        best, chosen = math.inf, 0
        for row in range(8):
            if table[row, 1] == math.inf:
                continue
            middle = table[row, 1] if row % 4 < 2 else turn_length(abs(table[row, 1]), c)
            length = turn_length(abs(table[row, 0]), c) + middle + turn_length(abs(table[row, 2]), c)
            if length < best:
                best, chosen = length, row
        count = _add_turn(pieces, count, table[chosen, 0], c, root)
        if chosen % 4 < 2:
            count = _add(pieces, count, table[chosen, 1] / root, 0.0, 0.0)
        else:
            count = _add_turn(pieces, count, table[chosen, 1], c, root)
        count = _add_turn(pieces, count, table[chosen, 2], c, root)
    return _add_ramp(pieces, count, 0.0, ends[1], root)


@kernel
def _add_profile(
    pieces: Floats, count: int, straight: bool, amounts: Floats, ends: Floats, c: Floats, root: float
) -> int:
    """The pieces of a forward profile (see profile.py)."""
    extreme, hold, rate = np.empty(3), np.empty(3), np.empty(3)
    shape(three_elements(straight), amounts, ends, c[LIMIT], extreme, hold, rate)
    k = ends[0]
    for i in range(3):
        count = _add_ramp(pieces, count, k, extreme[i], root)
        count = _add(pieces, count, hold[i] / root, extreme[i] * root, 0.0)
        k = extreme[i]
    return _add_ramp(pieces, count, k, ends[1], root)


@kernel
def way_time(start: Floats, goal: Floats, c: Floats, root: float, limits: Floats, hops: bool, pieces: Floats) -> float:
    """Seconds from one painted end to one painted beginning, with one kind of turn; `hops`: short hops included."""
    seen = complex(goal[X] - start[X], goal[Y] - start[Y]) * unit(-start[HEADING]) * root
    turn = _remainder(goal[HEADING] - start[HEADING])
    ends, amounts = np.empty(2), np.empty(3)
    ends[0], ends[1] = start[CURVATURE] / root, goal[CURVATURE] / root
    k = start[PAINTED]
    count = _add(pieces, 0, abs(k) / start[LEAD], k, -math.copysign(start[LEAD], k))
    count = _add(pieces, count, start[PAD], 0.0, 0.0)
    family = WORDS
    if hops:
        _, family = shortest_forward(ends, seen, turn, c, True, amounts)
    if family == WORDS:
        count = _add_word(pieces, count, ends, seen, turn, c, root)
    else:
        count = _add_profile(pieces, count, family == 1, amounts, ends, c, root)
    count = _add(pieces, count, goal[PAD], 0.0, 0.0)
    k = goal[PAINTED]
    count = _add(pieces, count, abs(k) / goal[LEAD], 0.0, math.copysign(goal[LEAD], k))
    return path_time(pieces, count, start[SPEED], goal[SPEED], limits)


@kernel
def way_times(
    starts: Floats, goals: Floats, circles: Floats, roots: Floats, limits: Floats, pairs: Ints, hops: bool
) -> Floats:
    """Seconds (n,) of the quickest way of every pair (n, 2) of start and goal.

    `starts` and `goals` are (turns, ends, COLUMNS), `circles` (turns, 6) and `roots` (turns,) the square roots of their
    sharpness.
    """
    pieces, seconds = np.empty((PIECES_MAX, 3)), np.full(len(pairs), np.inf)
    for p in range(len(pairs)):
        for k in range(len(circles)):
            start, goal = starts[k, pairs[p, 0]], goals[k, pairs[p, 1]]
            seconds[p] = min(seconds[p], way_time(start, goal, circles[k], roots[k], limits, hops, pieces))
    return seconds
