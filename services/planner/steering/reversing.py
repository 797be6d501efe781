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

from touchline.services.core.jit import kernel
from touchline.services.planner.geometry.clothoid import Floats, Ints
from touchline.services.planner.steering import cusp_words
from touchline.services.planner.steering.circles import LIMIT, TAU
from touchline.services.planner.steering.construct import MAX_PIECES, profile_pieces
from touchline.services.planner.steering.cusp_words import word
from touchline.services.planner.steering.flat_words import flat_pieces
from touchline.services.planner.steering.forward import TIE
from touchline.services.planner.steering.patterns import QUARTER, bend_amount, cusps_of, elements_of, ramps_beside
from touchline.services.planner.steering.profile import (
    AMOUNT,
    FAILED,
    MAX_ELEMENTS,
    STRAIGHT,
    UNKNOWN,
    shape,
    shoot,
    solve,
)
from touchline.services.planner.steering.symmetry import turn_pieces_round, turn_query_round

MAX_CUSPS = 4
# Between two standstills the robot drives at least this far (m); less would be a disguise for steering at a standstill.
STRETCH_MIN_M = 1e-3
# No straight starts from zero length.
STRAIGHT_MIN = 0.05
# A word this much longer than the best way is not tried: bends that do not reach the limit make it hardly shorter.
WORD_MARGIN = 1.0
# Curvatures that differ by less are one (in units of unit sharpness).
STEP = 1e-9


class PatternRow(NamedTuple):
    """Element kinds and directions (see patterns.py), and values."""

    kinds: str
    directions: str
    values: tuple[float, ...]


ROWS = (
    PatternRow("BBBB", "-++-", (-2.0, 2.0, -2.0, -0.15)),
    PatternRow("BBB", "-+-", (-0.8, 0.8, -0.15)),
    PatternRow("BSB", "---", (-2.0, 0.9, 0.15)),
    PatternRow("BBB", "++-", (-2.0, 2.0, -0.15)),
    PatternRow("BBB", "+--", (-0.8, 0.8, -0.8)),
    PatternRow("BBB", "+-+", (-0.8, 0.8, -0.15)),
    PatternRow("BSQB", "+++-", (-0.15, 0.9, QUARTER, -0.8)),
    PatternRow("BBB", "---", (-2.0, 0.8, -0.8)),
    PatternRow("BQSB", "+---", (-0.8, QUARTER, 0.9, -0.15)),
    PatternRow("BBB", "++-", (-0.8, 0.15, -0.15)),
    PatternRow("BBB", "-+-", (-2.0, 0.15, -2.0)),
    PatternRow("BSB", "++-", (-0.8, 0.15, -0.8)),
    PatternRow("BBB", "++-", (-0.15, 0.15, -2.0)),
    PatternRow("BQSQB", "-+++-", (-0.15, QUARTER, 0.9, -QUARTER, -2.0)),
    PatternRow("BBB", "++-", (-0.15, 0.8, -0.8)),
    PatternRow("BBB", "++-", (-0.15, 2.0, -2.0)),
    PatternRow("BSB", "-+-", (-2.0, 0.9, -0.15)),
    PatternRow("BBBB", "+--+", (-2.0, 0.15, -0.15, 0.8)),
    PatternRow("BSQB", "+++-", (-0.8, 0.9, QUARTER, 0.8)),
    PatternRow("BBB", "+--", (-0.8, 0.8, -0.15)),
    PatternRow("BBBB", "++--", (-0.15, 0.8, -0.8, 0.8)),
    PatternRow("BQSQB", "+---+", (-2.0, QUARTER, 0.15, QUARTER, -2.0)),
    PatternRow("BBBB", "-++-", (-0.8, 0.15, -0.15, 0.15)),
    PatternRow("BBBB", "-++-", (-2.0, 0.8, -0.8, -0.8)),
    PatternRow("BBB", "++-", (-2.0, 0.8, -0.8)),
    PatternRow("BBB", "+--", (-2.0, 0.8, -0.15)),
    PatternRow("BSQB", "+++-", (-0.15, 0.9, QUARTER, -0.15)),
    PatternRow("BQSB", "+---", (0.15, QUARTER, 0.9, 0.15)),
    PatternRow("BSB", "---", (-0.15, 0.9, -0.15)),
)


def _both_ways(row: PatternRow) -> list[PatternRow]:
    """The row, mirrored and turned round."""
    kinds, directions, values = row
    mirrored = tuple(v if kind == "S" else -v for kind, v in zip(kinds, values, strict=True))
    ways = (values, mirrored)
    return [PatternRow(kinds, directions, w) for w in ways] + [
        PatternRow(kinds[::-1], directions[::-1], w[::-1]) for w in ways
    ]


_ALL = list(dict.fromkeys(way for row in ROWS for way in _both_ways(row)))
COUNTS = np.array([len(row.kinds) for row in _ALL])
ELEMENTS = np.array([elements_of(row.kinds, row.directions) for row in _ALL])
VALUES = np.array([row.values + (0.0,) * (MAX_ELEMENTS - len(row.values)) for row in _ALL])
CUSPS = np.array([cusps_of(row.directions) for row in _ALL])


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
def shortest_reversing(
    ends: Floats,
    goal: complex,
    turn: float,
    c: Floats,
    stretch_min: float,
    lengths: Floats,
    ways: Floats,
    counts: Ints,
) -> None:
    """For every number of cusps up to MAX_CUSPS the shortest way from the origin heading along +x.

    Fills `lengths` (infinite where there is no way), the pieces `ways` (·, MAX_PIECES, 4) and their numbers `counts`.
    `ends` are the curvatures at both ends, at most that of the circle `c`, which matter where the way begins or ends
    forward. No stretch in one direction is shorter than `stretch_min`.
    """
    lengths[:] = FAILED
    _shorten(ends, goal, turn, c, stretch_min, False, lengths, ways, counts)
    other_ends = np.empty(2)
    other_goal, other_turn = turn_query_round(ends, goal, turn, other_ends)
    _shorten(other_ends, other_goal, other_turn, c, stretch_min, True, lengths, ways, counts)


@kernel
def _shorten(
    ends: Floats,
    goal: complex,
    turn: float,
    c: Floats,
    stretch_min: float,
    turned_round: bool,
    lengths: Floats,
    ways: Floats,
    counts: Ints,
) -> None:
    """Replace what Newton's method, from the rows and the words, finds shorter ways for."""
    u, pieces = np.empty(3), np.empty((MAX_PIECES, 4))
    for row in range(len(COUNTS)):
        elements = started(row, c[LIMIT], abs(goal), u)
        cusps = CUSPS[row]
        length, n = attempt(elements, u, ends, c[LIMIT], goal, turn, stretch_min, lengths[cusps] - TIE, pieces)
        if n:
            keep(pieces, n, turned_round, ways[cusps])
            lengths[cusps], counts[cusps] = length, n
    for family in range(len(cusp_words.COUNTS)):
        elements = cusp_words.ELEMENTS[family, : cusp_words.COUNTS[family]].copy()
        cusps = cusp_words.CUSPS[family]
        for branch in range(cusp_words.BRANCHES[family]):
            length = word(family, branch, ends, goal, turn, c, elements, u)
            if math.isinf(length) or length > lengths[cusps] + WORD_MARGIN:
                continue
            n = flat_pieces(elements, u, ends, c, pieces)
            length = pieces[:n, 0].sum()
            if n and length < lengths[cusps] - TIE and is_way(pieces, n, ends, stretch_min):
                keep(pieces, n, turned_round, ways[cusps])
                lengths[cusps], counts[cusps] = length, n
            length, n = attempt(elements, u, ends, c[LIMIT], goal, turn, stretch_min, lengths[cusps] - TIE, pieces)
            if n:
                keep(pieces, n, turned_round, ways[cusps])
                lengths[cusps], counts[cusps] = length, n


@kernel
def attempt(
    elements: Floats,
    u: Floats,
    ends: Floats,
    limit: float,
    goal: complex,
    turn: float,
    stretch_min: float,
    longest: float,
    pieces: Floats,
) -> tuple[float, int]:
    """Length and number of `pieces` of the way that Newton's method reaches from `u`; 0 if none below `longest`."""
    n = len(elements)
    extreme, hold, rate = np.empty(n), np.empty(n), np.empty(n)
    points, headings = np.empty(n, np.complex128), np.empty(n)
    shape(elements, u, ends, limit, extreme, hold, rate)
    _, intended, _ = shoot(elements, ends, extreme, hold, points, headings)
    length = solve(elements, u, ends, limit, goal, turn + TAU * round((intended - turn) / TAU))
    if length >= longest:
        return FAILED, 0
    count = profile_pieces(elements, u, ends, limit, pieces)
    return (length, count) if is_way(pieces, count, ends, stretch_min) else (FAILED, 0)


@kernel
def is_way(pieces: Floats, count: int, ends: Floats, stretch_min: float) -> bool:
    """Whether the pieces can be driven: no stretch is too short, and curvature steps at cusps alone."""
    return bool(shortest_stretch(pieces, count) >= stretch_min and meets(pieces, count, ends))


@kernel
def meets(pieces: Floats, count: int, ends: Floats) -> bool:
    """Whether curvature steps at cusps alone, the ends included, where what comes before and behind is forward.

    It does not where a stretch between two cusps has come to no length.
    """
    direction, curvature = 1.0, ends[0]
    for i in range(count):
        if pieces[i, 3] == direction and abs(pieces[i, 1] - curvature) > STEP:
            return False
        direction, curvature = pieces[i, 3], pieces[i, 1] + pieces[i, 2] * pieces[i, 0]
    return bool(direction < 0.0 or abs(curvature - ends[1]) <= STEP)


@kernel
def keep(pieces: Floats, n: int, turned_round: bool, way: Floats) -> None:
    """Copy the pieces of a way, the right way round."""
    way[:n] = pieces[:n]
    if turned_round:
        turn_pieces_round(way, n)


@kernel
def shortest_stretch(pieces: Floats, n: int) -> float:
    """Length of the shortest stretch in one direction."""
    shortest, stretch = math.inf, 0.0
    for i in range(n):
        stretch += pieces[i, 0]
        if i + 1 == n or pieces[i + 1, 3] != pieces[i, 3]:
            shortest = min(shortest, stretch)
            stretch = 0.0
    return shortest
