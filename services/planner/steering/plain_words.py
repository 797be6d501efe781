"""Compiled: shortest plain Dubins paths (Dubins 1957), as pieces, or as lengths for many pairs of poses at once.

Lengths are in units of the turning radius inside the kernels, so that a turn is as long as its deflection.
"""

import math

import numpy as np

from touchline.core.arcs import unit
from touchline.core.arrays import copy
from touchline.core.jit import kernel
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.steering.circles import ON_PATH, left_centres, word_table, wrapped
from touchline.services.planner.steering.construct import put
from touchline.services.planner.steering.dubins_bound import PLAIN

# Rows of `word_table` in the order of `words.py`, which decides between words of equal length.
_ORDER = (0, 2, 3, 1, 4, 6, 7, 5)
_TIE = 1e-9


@kernel
def plain_word(x: float, y: float, heading: float, weight: float, word: Floats) -> tuple[float, bool]:
    """Cost of the cheapest word to a pose, and whether its middle is straight; the radius of turns is 1.

    Args:
        x: x of the goal.
        y: y of the goal.
        heading: Heading of the goal (rad).
        weight: Factor on the length of turns.
        word: (3,) signed deflection (rad), signed deflection or length of the straight, signed deflection; filled in.
    """
    cos, sin = math.cos(heading), math.sin(heading)
    best, straight = math.inf, True
    word[:] = 0.0
    if abs(y) <= ON_PATH and x >= -ON_PATH and cos > 0.0 and abs(sin) <= ON_PATH:
        best, word[1] = max(x, 0.0), max(x, 0.0)
    table = np.empty((8, 3))
    word_table(x, y, heading, PLAIN, table)
    for first in (0, 4):
        side = 1.0 if first == 0 else -1.0
        left_x, left_y, _, _ = left_centres(x, side * y, cos, side * sin, PLAIN)
        if left_x * left_x + left_y * left_y <= ON_PATH * ON_PATH:
            deflection = wrapped(side * heading)
            if weight * deflection < best - _TIE:
                best, straight = weight * deflection, True
                word[0], word[1], word[2] = side * deflection, 0.0, 0.0
        for row in _ORDER:
            if row // 4 * 4 != first or table[row, 1] == math.inf:
                continue
            middle_straight = row % 4 < 2
            taken = weight * (abs(table[row, 0]) + abs(table[row, 2]))
            taken += abs(table[row, 1]) * (1.0 if middle_straight else weight)
            if taken < best - _TIE:
                best, straight = taken, middle_straight
                copy(table[row], word)
    return best, straight


@kernel
def put_plain_word(start: Floats, goal: Floats, curvature: float, pieces: Floats, n: int) -> int:
    """Append the shortest plain word (Dubins 1957) between two poses; return the number of pieces.

    Args:
        start: (3 or more,) x (m), y (m) and heading (rad).
        goal: (3 or more,) the same.
        curvature: Curvature of the turns (1/m).
        pieces: (many, 4 or 5) filled in, in metres.
        n: Number of pieces so far.
    """
    seen = complex(goal[0] - start[0], goal[1] - start[1]) * unit(-start[2]) * curvature
    word = np.empty(3)
    _, straight = plain_word(seen.real, seen.imag, goal[2] - start[2], 1.0, word)
    for i in range(3):
        bend = 0.0 if straight and i == 1 else math.copysign(curvature, word[i])
        n = put(pieces, n, abs(word[i]) / curvature, bend, 0.0, 1.0)
    return n


@kernel
def _fill_lengths(starts: Floats, goals: Floats, curvature: float, weight: float, out: Floats) -> None:
    word = np.empty(3)
    for i in range(len(starts)):
        towards = unit(-starts[i, 2]) * curvature
        for j in range(len(goals)):
            seen = complex(goals[j, 0] - starts[i, 0], goals[j, 1] - starts[i, 1]) * towards
            out[i, j] = plain_word(seen.real, seen.imag, goals[j, 2] - starts[i, 2], weight, word)[0] / curvature


def plain_lengths(starts: Floats, goals: Floats, curvature_max_1pm: float, *, turn_weight: float = 1.0) -> Floats:
    """Lengths (m) (n, m) of plain Dubins paths from every start (n, 3) to every goal (m, 3).

    Both are rows of x (m), y (m) and heading (rad); further columns are ignored. `turn_weight` multiplies the length
    of turns, also in the choice of words (see `word_lengths`).

    Args:
        starts: (n, 3 or more) x (m), y (m), heading (rad).
        goals: (m, 3 or more) the same.
        curvature_max_1pm: Curvature of the turns.
        turn_weight: Factor on the length of turns.
    """
    out = np.empty((len(starts), len(goals)))
    tables = (np.ascontiguousarray(rows[:, :3], dtype=np.float64) for rows in (starts, goals))
    _fill_lengths(*tables, curvature_max_1pm, turn_weight, out)
    return out
