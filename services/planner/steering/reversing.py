"""The shortest ways with cusps: curvature-continuous relatives of the words of Reeds and Shepp.

Curvature is continuous between cusps, and may step at a cusp, where the robot stands. A way that begins or ends
backward has a cusp there, against the forward motion before or after it. Each row below is a pattern of elements (see
profile.py) with deflections (rad) from which Newton's method starts; a straight has a share of the distance instead.
Every row is used to both sides and in both orders. The rows were chosen so that they find the best that four thousand
find.
"""

import math
from typing import NamedTuple

import numpy as np

from schemas.arrays import copy
from schemas.jit import kernel
from services.planner.clothoid import Floats, Ints
from services.planner.steering.circles import TAU
from services.planner.steering.construct import MAX_PIECES, profile_pieces
from services.planner.steering.forward import TIE
from services.planner.steering.profile import (
    AMOUNT,
    DIRECTION,
    FAILED,
    MAX_ELEMENTS,
    STRAIGHT,
    UNKNOWN,
    shape,
    shoot,
    solve,
)

QUARTER = 0.5 * math.pi
MAX_CUSPS = 4
# Between two standstills the robot drives at least this far (m); less would be a disguise for steering at a standstill.
STRETCH_MIN_M = 1e-3
# No straight starts from zero length.
STRAIGHT_MIN = 0.05


class Row(NamedTuple):
    """Element kinds (B: bend, S: straight, Q: bend by a quarter turn, which is fixed), directions, and values.

    Of four bends the inner two share one unknown with opposite signs.
    """

    kinds: str
    directions: str
    values: tuple[float, ...]


ROWS = (
    Row("BBBB", "-++-", (-2.0, 2.0, -2.0, -0.15)),
    Row("BBB", "-+-", (-0.8, 0.8, -0.15)),
    Row("BSB", "---", (-2.0, 0.9, 0.15)),
    Row("BBB", "++-", (-2.0, 2.0, -0.15)),
    Row("BBB", "+--", (-0.8, 0.8, -0.8)),
    Row("BBB", "+-+", (-0.8, 0.8, -0.15)),
    Row("BSQB", "+++-", (-0.15, 0.9, QUARTER, -0.8)),
    Row("BBB", "---", (-2.0, 0.8, -0.8)),
    Row("BQSB", "+---", (-0.8, QUARTER, 0.9, -0.15)),
    Row("BBB", "++-", (-0.8, 0.15, -0.15)),
    Row("BBB", "-+-", (-2.0, 0.15, -2.0)),
    Row("BSB", "++-", (-0.8, 0.15, -0.8)),
    Row("BBB", "++-", (-0.15, 0.15, -2.0)),
    Row("BQSQB", "-+++-", (-0.15, QUARTER, 0.9, -QUARTER, -2.0)),
    Row("BBB", "++-", (-0.15, 0.8, -0.8)),
    Row("BBB", "++-", (-0.15, 2.0, -2.0)),
    Row("BSB", "-+-", (-2.0, 0.9, -0.15)),
    Row("BBBB", "+--+", (-2.0, 0.15, -0.15, 0.8)),
    Row("BSQB", "+++-", (-0.8, 0.9, QUARTER, 0.8)),
    Row("BBB", "+--", (-0.8, 0.8, -0.15)),
    Row("BBBB", "++--", (-0.15, 0.8, -0.8, 0.8)),
    Row("BQSQB", "+---+", (-2.0, QUARTER, 0.15, QUARTER, -2.0)),
    Row("BBBB", "-++-", (-0.8, 0.15, -0.15, 0.15)),
    Row("BBBB", "-++-", (-2.0, 0.8, -0.8, -0.8)),
    Row("BBB", "++-", (-2.0, 0.8, -0.8)),
    Row("BBB", "+--", (-2.0, 0.8, -0.15)),
    Row("BSQB", "+++-", (-0.15, 0.9, QUARTER, -0.15)),
    Row("BQSB", "+---", (0.15, QUARTER, 0.9, 0.15)),
    Row("BSB", "---", (-0.15, 0.9, -0.15)),
)


def _both_ways(row: Row) -> list[Row]:
    """The row, mirrored and turned round."""
    kinds, directions, values = row
    mirrored = tuple(v if kind == "S" else -v for kind, v in zip(kinds, values, strict=True))
    ways = (values, mirrored)
    return [Row(kinds, directions, w) for w in ways] + [Row(kinds[::-1], directions[::-1], w[::-1]) for w in ways]


def _elements(row: Row) -> Floats:
    """The elements (see profile.py), where fixed bends have no unknown and no amount yet."""
    elements = np.zeros((MAX_ELEMENTS, 4))
    unknown = 0
    for i, kind in enumerate(row.kinds):
        elements[i, STRAIGHT] = kind == "S"
        elements[i, DIRECTION] = 1.0 if row.directions[i] == "+" else -1.0
        elements[i, UNKNOWN], elements[i, AMOUNT] = (-1, 0.0) if kind == "Q" else (unknown, 1.0)
        if row.kinds == "BBBB" and i == 2:
            elements[i, UNKNOWN], elements[i, AMOUNT] = 1, -1.0
        elif kind != "Q":
            unknown += 1
    return elements


def _cusps(directions: str) -> int:
    around = f"+{directions}+"
    return around.count("+-") + around.count("-+")


_ALL = list(dict.fromkeys(way for row in ROWS for way in _both_ways(row)))
COUNTS = np.array([len(row.kinds) for row in _ALL])
ELEMENTS = np.array([_elements(row) for row in _ALL])
VALUES = np.array([row.values + (0.0,) * (MAX_ELEMENTS - len(row.values)) for row in _ALL])
CUSPS = np.array([_cusps(row.directions) for row in _ALL])


@kernel
def ramps_beside(elements: Floats, i: int) -> int:
    """How many clothoids lie beside element `i`: one towards each neighbour of its own direction."""
    before = elements[i - 1, DIRECTION] if i > 0 else 1.0
    after = elements[i + 1, DIRECTION] if i + 1 < len(elements) else 1.0
    return int(before == elements[i, DIRECTION]) + int(after == elements[i, DIRECTION])


@kernel
def bend_amount(deflection: float, ramps: int, limit: float) -> float:
    """The amount of a bend by `deflection` with so many clothoids, as if they led to straights."""
    size, spirals = abs(deflection), 0.5 * ramps * limit * limit
    if ramps == 0:
        amount = size / limit
    elif size < spirals:
        amount = math.sqrt(2.0 * size / ramps)
    else:
        amount = limit + (size - spirals) / (ramps * limit)
    return math.copysign(amount, deflection)


@kernel
def started(row: int, limit: float, distance: float, u: Floats) -> Floats:
    """The elements of a row, with the amounts of fixed bends; fills the start of the unknowns `u`."""
    elements = ELEMENTS[row, : COUNTS[row]].copy()
    for i in range(len(elements) - 1, -1, -1):
        which = int(elements[i, UNKNOWN])
        if elements[i, STRAIGHT] != 0.0:
            amount = STRAIGHT_MIN + VALUES[row, i] * distance
        else:
            amount = bend_amount(VALUES[row, i], ramps_beside(elements, i), limit)
        if which < 0:
            elements[i, AMOUNT] = amount
        else:
            u[which] = amount
    return elements


@kernel
def shortest_stretch(elements: Floats, u: Floats, ends: Floats, limit: float, pieces: Floats) -> float:
    """Length of the shortest stretch in one direction."""
    n = profile_pieces(elements, u, ends, limit, pieces)
    shortest, stretch = math.inf, 0.0
    for i in range(n):
        stretch += pieces[i, 0]
        if i + 1 == n or pieces[i + 1, 3] != pieces[i, 3]:
            shortest = min(shortest, stretch)
            stretch = 0.0
    return shortest


@kernel
def shortest_reversing(
    ends: Floats,
    goal: complex,
    turn: float,
    limit: float,
    stretch_min: float,
    lengths: Floats,
    amounts: Floats,
    rows: Ints,
) -> None:
    """For every number of cusps up to MAX_CUSPS the shortest way from the origin heading along +x.

    Fills `lengths` (infinite where there is no way), `amounts` (·, 3) and `rows`. `ends` are the curvatures at both
    ends, within ±`limit`, which matter where the way begins or ends forward. No stretch in one direction is shorter
    than `stretch_min`.
    """
    lengths[:] = FAILED
    u = np.empty(3)
    extreme, hold, rate = np.empty(MAX_ELEMENTS), np.empty(MAX_ELEMENTS), np.empty(MAX_ELEMENTS)
    points, headings = np.empty(MAX_ELEMENTS, np.complex128), np.empty(MAX_ELEMENTS)
    pieces = np.empty((MAX_PIECES, 4))
    for row in range(len(COUNTS)):
        elements = started(row, limit, abs(goal), u)
        shape(elements, u, ends, limit, extreme, hold, rate)
        _, intended, _ = shoot(elements, ends, extreme, hold, points, headings)
        length = solve(elements, u, ends, limit, goal, turn + TAU * round((intended - turn) / TAU))
        cusps = CUSPS[row]
        if length < lengths[cusps] - TIE and shortest_stretch(elements, u, ends, limit, pieces) >= stretch_min:
            lengths[cusps] = length
            copy(u, amounts[cusps])
            rows[cusps] = row
