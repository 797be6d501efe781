"""Compiled: the shortest transitions with cusps, curvature-continuous relatives of the words of Reeds and Shepp.

Reeds and Shepp, "Optimal paths for a car that goes both forwards and backwards", Pacific Journal of Mathematics 145(2),
1990.

Curvature is continuous between cusps, and may step at a cusp, where the robot stands. A path that begins or ends
backward has a cusp there, against the forward motion before or after it. Each row below is a pattern of elements (see
profile.py) with deflections (rad) from which Newton's method starts; a straight has a share of the distance instead.
Every row is used to both sides and in both orders. The rows were chosen so that they find the best that four thousand
find.
"""

import math
from typing import NamedTuple

import numpy as np

from touchline.core.angles import TAU
from touchline.core.arrays import copy_rows
from touchline.core.jit import kernel
from touchline.services.planner.geometry.clothoid import Floats, Ints
from touchline.services.planner.steering import cusp_words
from touchline.services.planner.steering.circles import LIMIT
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
    shape_for,
    shoot,
    solve,
)
from touchline.services.planner.steering.query import Query
from touchline.services.planner.steering.symmetry import turn_pieces_round, turn_query_round

MAX_CUSPS = 4
# Between two standstills the robot drives at least this far (m); less would be a disguise for steering at a standstill.
STRETCH_MIN_M = 1e-3
# No straight starts from zero length.
STRAIGHT_MIN = 0.05
# A word this much longer than the best path is not tried: bends that do not reach the limit make it hardly shorter.
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


def _both_directions(row: PatternRow) -> list[PatternRow]:
    """The row, mirrored and turned round."""
    kinds, directions, values = row
    mirrored = tuple(v if kind == "S" else -v for kind, v in zip(kinds, values, strict=True))
    sides = (values, mirrored)
    return [PatternRow(kinds, directions, w) for w in sides] + [
        PatternRow(kinds[::-1], directions[::-1], w[::-1]) for w in sides
    ]


_ALL = list(dict.fromkeys(each for row in ROWS for each in _both_directions(row)))
COUNTS = np.array([len(row.kinds) for row in _ALL])
ELEMENTS = np.array([elements_of(row.kinds, row.directions) for row in _ALL])
VALUES = np.array([row.values + (0.0,) * (MAX_ELEMENTS - len(row.values)) for row in _ALL])
CUSPS = np.array([cusps_of(row.directions) for row in _ALL])


@kernel
def started(row: int, limit: float, distance: float, u: Floats) -> Floats:
    """The elements (n, 4) of a row, with the amounts of its fixed bends, and where Newton's method starts.

    Args:
        row: A row of `ELEMENTS`.
        limit: Largest curvature.
        distance: From the start to the goal.
        u: (3,) the unknown amounts, filled in.
    """
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


class Shortest(NamedTuple):
    """The shortest path for every number of cusps.

    Attributes:
        lengths: (MAX_CUSPS + 1,) infinite where there is no path.
        paths: (MAX_CUSPS + 1, MAX_PIECES, 4) their pieces.
        counts: (MAX_CUSPS + 1,) how many these are.
    """

    lengths: Floats
    paths: Floats
    counts: Ints


@kernel
def shortest_reversing(query: Query, stretch_min: float, found: Shortest) -> None:
    """Find the shortest path for every number of cusps up to MAX_CUSPS.

    The curvatures at both ends matter where it begins or ends forward.

    Args:
        query: What is asked.
        stretch_min: No stretch in one direction is shorter.
        found: Filled in.
    """
    found.lengths[:] = FAILED
    _shorten(query, stretch_min, False, found)
    _shorten(turn_query_round(query), stretch_min, True, found)


@kernel
def _shorten(query: Query, stretch_min: float, turned_round: bool, found: Shortest) -> None:
    """Replace the paths for which Newton's method, started from the rows and the words, finds shorter ones."""
    c, lengths = query.circle, found.lengths
    u, pieces = np.empty(3), np.empty((MAX_PIECES, 4))
    for row in range(len(COUNTS)):
        elements = started(row, c[LIMIT], abs(query.goal), u)
        cusps = CUSPS[row]
        length, n = attempt(elements, u, query, stretch_min, lengths[cusps] - TIE, pieces)
        if n:
            _keep(pieces, n, length, turned_round, cusps, found)
    for family in range(len(cusp_words.COUNTS)):
        elements = cusp_words.ELEMENTS[family, : cusp_words.COUNTS[family]].copy()
        cusps = cusp_words.CUSPS[family]
        for branch in range(cusp_words.BRANCHES[family]):
            length = word(family, branch, query, elements, u)
            if math.isinf(length) or length > lengths[cusps] + WORD_MARGIN:
                continue
            n = flat_pieces(elements, u, query.ends, c, pieces)
            length = pieces[:n, 0].sum()
            if n and length < lengths[cusps] - TIE and is_feasible(pieces, n, query.ends, stretch_min):
                _keep(pieces, n, length, turned_round, cusps, found)
            length, n = attempt(elements, u, query, stretch_min, lengths[cusps] - TIE, pieces)
            if n:
                _keep(pieces, n, length, turned_round, cusps, found)


@kernel
def _keep(pieces: Floats, n: int, length: float, turned_round: bool, cusps: int, found: Shortest) -> None:
    """Store a path as the shortest with its number of cusps; one of the query turned round is turned back."""
    path = found.paths[cusps]
    copy_rows(pieces, path, n)
    if turned_round:
        turn_pieces_round(path, n)
    found.lengths[cusps], found.counts[cusps] = length, n


@kernel
def attempt(
    elements: Floats, u: Floats, query: Query, stretch_min: float, longest: float, pieces: Floats
) -> tuple[float, int]:
    """The path that Newton's method reaches: its length and number of pieces; FAILED and 0 if there is none.

    Args:
        elements: (n, 4) with the amounts of fixed bends.
        u: (3,) the unknown amounts: where to start, and then the solution.
        query: What is asked.
        stretch_min: Least length of a stretch in one direction.
        longest: Only a shorter path counts.
        pieces: (MAX_PIECES, 4) filled in.
    """
    n = len(elements)
    ends, limit, turn = query.ends, query.circle[LIMIT], query.turn
    shaped = shape_for(elements)
    points, headings = np.empty(n, np.complex128), np.empty(n)
    shape(elements, u, ends, limit, shaped)
    _, intended, _ = shoot(elements, ends, shaped, points, headings)
    length = solve(elements, u, ends, limit, query.goal, turn + TAU * round((intended - turn) / TAU))
    if length >= longest:
        return FAILED, 0
    count = profile_pieces(elements, u, ends, limit, pieces)
    return (length, count) if is_feasible(pieces, count, ends, stretch_min) else (FAILED, 0)


@kernel
def is_feasible(pieces: Floats, count: int, ends: Floats, stretch_min: float) -> bool:
    """Whether a path can be driven: no stretch is too short, and curvature steps at cusps alone.

    Args:
        pieces: (MAX_PIECES, 4) those of the path.
        count: How many of them there are.
        ends: (2,) curvatures at the start and at the goal.
        stretch_min: Least length of a stretch in one direction.
    """
    return bool(shortest_stretch(pieces, count) >= stretch_min and meets(pieces, count, ends))


@kernel
def meets(pieces: Floats, count: int, ends: Floats) -> bool:
    """Whether curvature steps at cusps alone; before and behind the path the robot drives forward.

    It steps elsewhere if a stretch between two cusps has shrunk to nothing, so that its neighbours meet.

    Args:
        pieces: (MAX_PIECES, 4) those of the path.
        count: How many of them there are.
        ends: (2,) curvatures at the start and at the goal.
    """
    direction, curvature = 1.0, ends[0]
    for i in range(count):
        if pieces[i, 3] == direction and abs(pieces[i, 1] - curvature) > STEP:
            return False
        direction, curvature = pieces[i, 3], pieces[i, 1] + pieces[i, 2] * pieces[i, 0]
    return bool(direction < 0.0 or abs(curvature - ends[1]) <= STEP)


@kernel
def shortest_stretch(pieces: Floats, n: int) -> float:
    """Length of the shortest stretch in one direction.

    Args:
        pieces: (MAX_PIECES, 4) those of the path.
        n: How many of them there are.
    """
    shortest, stretch = math.inf, 0.0
    for i in range(n):
        stretch += pieces[i, 0]
        if i + 1 == n or pieces[i + 1, 3] != pieces[i, 3]:
            shortest = min(shortest, stretch)
            stretch = 0.0
    return shortest
