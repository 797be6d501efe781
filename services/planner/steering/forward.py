"""The shortest way driven forward, where the goal is so close that the six words of turning circles are too long.

Two families of profiles between any two curvatures: bend, bend, bend (the middle one may also be a dent between two
bends to one side) and bend, straight, bend. Newton's method starts from a fixed set of deflections, which was chosen so
that it finds the best that a hundred times as many starts find.
"""

import math

import numpy as np

from schemas.jit import kernel
from services.planner.clothoid import Floats
from services.planner.steering.profile import AMOUNT, DIRECTION, FAILED, STRAIGHT, UNKNOWN, amount_of, solve

TAU = 2.0 * math.pi

# Deflections (rad) of the bends; in BEND_STRAIGHT_BEND the middle one is a length. All are used to both sides and in
# both orders.
BENDS = (
    (-1.2, 4.2, -0.05),
    (-4.2, 0.05, -0.4),
    (-1.2, 0.05, -0.4),
    (-0.4, 4.2, -0.05),
    (-1.2, 4.2, -0.4),
    (-4.2, -0.4, -4.2),
    (-4.2, 0.05, -1.2),
    (-4.2, 2.5, -1.2),
    (-1.2, 4.2, 0.05),
    (-4.2, 1.2, -2.5),
)
BEND_STRAIGHT_BEND = ((-4.2, 3.0, -2.5), (-2.5, 3.0, -0.05), (-4.2, 3.0, 2.5), (-4.2, 0.5, -4.2), (-2.5, 0.5, 0.05))


def _both_ways(starts: tuple[tuple[float, float, float], ...], middle: float) -> Floats:
    """The starts, mirrored (the middle one multiplied by `middle`) and turned round, each once."""
    ways = [way for a, b, c in starts for way in ((a, b, c), (c, b, a), (-a, middle * b, -c), (-c, middle * b, -a))]
    return np.array(list(dict.fromkeys(ways)))


_BENDS = _both_ways(BENDS, -1.0)
_STRAIGHTS = _both_ways(BEND_STRAIGHT_BEND, 1.0)
STARTS = np.concatenate((_BENDS, _STRAIGHTS))
WITH_STRAIGHT = np.arange(len(STARTS)) >= len(_BENDS)


@kernel
def three_elements(straight_middle: bool) -> Floats:
    """Bend, bend or straight, bend, all forward, each with an unknown of its own."""
    elements = np.zeros((3, 4))
    for i in range(3):
        elements[i, DIRECTION] = 1.0
        elements[i, UNKNOWN] = i
        elements[i, AMOUNT] = 1.0
    elements[1, STRAIGHT] = 1.0 if straight_middle else 0.0
    return elements


@kernel
def short_hop(ends: Floats, limit: float, goal: complex, turn: float, best: float, amounts: Floats) -> tuple[float, int]:
    """The shortest profile below `best` and its family (0: bends only, 1: with a straight, −1: none); fills `amounts`.

    `ends` are the curvatures at both ends, within ±`limit`; `goal` is seen from the start, with any multiple of a full
    turn in `turn`.
    """
    family = -1
    u = np.empty(3)
    rows = (three_elements(False), three_elements(True))
    for s in range(len(STARTS)):
        straight = WITH_STRAIGHT[s]
        for i in range(3):
            u[i] = STARTS[s, i] if straight and i == 1 else amount_of(STARTS[s, i], limit)
        intended = turn_of(u, straight, ends, limit)
        wrapped = turn + TAU * round((intended - turn) / TAU)
        length = solve(rows[1] if straight else rows[0], u, ends, limit, goal, wrapped)
        if length < best - 1e-10:
            best, family = length, 1 if straight else 0
            amounts[:] = u
    return (best if family >= 0 else FAILED), family


@kernel
def turn_of(u: Floats, straight_middle: bool, ends: Floats, limit: float) -> float:
    """Turn of the whole forward profile of three elements with amounts `u`."""
    turn, last = 0.0, ends[0]
    for i in range(4):
        if i == 3:
            k, hold = ends[1], 0.0
        elif straight_middle and i == 1:
            k, hold = 0.0, 0.0
        else:
            k = min(max(u[i], -limit), limit)
            hold = 2.0 * (abs(u[i]) - abs(k))
        turn += 0.5 * (k + last) * abs(k - last) + k * hold
        last = k
    return turn
