"""Compiled: shortest transitions with cusps, curvature-continuous relatives of the words of Reeds and Shepp.

Reeds and Shepp, "Optimal paths for a car that goes both forwards and backwards", Pacific Journal of Mathematics 145(2),
1990.

Curvature is continuous between cusps, and may step at a cusp, where the robot rests. A path that begins or ends
backward has a cusp there, against the forward motion before or after it. Each row below is a pattern of elements (see
profile.py) with deflections (rad) from which Newton's method starts; a straight has a fraction of the distance instead.
Every row is used mirrored and reversed, too. The rows were chosen to find the best paths that four thousand rows find.
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
from touchline.services.planner.steering.symmetry import reverse_pieces, reversed_query

MAX_CUSPS = 4
# Minimum length (m) between two standstills; less would amount to steering at rest.
STRETCH_MIN_M = 1e-3
# Minimum length of a straight where Newton's method starts.
STRAIGHT_MIN = 0.05
# A word this much longer than the best path is not tried: bends below the limit hardly shorten it.
WORD_MARGIN = 1.0
# Curvatures that differ by less are equal (in units of unit sharpness).
STEP = 1e-9


class PatternRow(NamedTuple):
    """Element kinds and directions (see patterns.py), and start values."""

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
    """Return a row and its mirrored and reversed versions."""
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
    """Elements (n, 4) of a row, with the amounts of its fixed bends; fills in the start of Newton's method.

    Args:
        row: Row of `ELEMENTS`.
        limit: Maximum curvature.
        distance: Distance from the start to the goal.
        u: (3,) unknown amounts, filled in.
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
    """Shortest path for every number of cusps.

    Attributes:
        lengths: (MAX_CUSPS + 1,) lengths, infinite where there is no path.
        paths: (MAX_CUSPS + 1, MAX_PIECES, 4) pieces.
        counts: (MAX_CUSPS + 1,) numbers of pieces.
    """

    lengths: Floats
    paths: Floats
    counts: Ints


@kernel
def shortest_reversing(query: Query, stretch_min: float, found: Shortest) -> None:
    """Find the shortest path for every number of cusps up to MAX_CUSPS.

    The curvatures of the ends matter only where the path begins or ends forward.

    Args:
        query: Query of the path search.
        stretch_min: Minimum length of a stretch in one direction.
        found: Paths, filled in.
    """
    found.lengths[:] = FAILED
    _shorten(query, stretch_min, False, found)
    _shorten(reversed_query(query), stretch_min, True, found)


@kernel
def _shorten(query: Query, stretch_min: float, from_goal: bool, found: Shortest) -> None:
    """Replace paths by shorter ones that Newton's method finds from the rows and the words."""
    c, lengths = query.circle, found.lengths
    u, pieces = np.empty(3), np.empty((MAX_PIECES, 4))
    for row in range(len(COUNTS)):
        elements = started(row, c[LIMIT], abs(query.goal), u)
        cusps = CUSPS[row]
        length, n = attempt(elements, u, query, stretch_min, lengths[cusps] - TIE, pieces)
        if n:
            _keep(pieces, n, length, from_goal, cusps, found)
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
                _keep(pieces, n, length, from_goal, cusps, found)
            length, n = attempt(elements, u, query, stretch_min, lengths[cusps] - TIE, pieces)
            if n:
                _keep(pieces, n, length, from_goal, cusps, found)


@kernel
def _keep(pieces: Floats, n: int, length: float, from_goal: bool, cusps: int, found: Shortest) -> None:
    """Store a path as the shortest with its number of cusps; a path of the reversed query is reversed back."""
    path = found.paths[cusps]
    copy_rows(pieces, path, n)
    if from_goal:
        reverse_pieces(path, n)
    found.lengths[cusps], found.counts[cusps] = length, n


@kernel
def attempt(
    elements: Floats, u: Floats, query: Query, stretch_min: float, longest: float, pieces: Floats
) -> tuple[float, int]:
    """Length and number of pieces of the path that Newton's method reaches; FAILED and 0 if there is none.

    Args:
        elements: (n, 4) with the amounts of fixed bends.
        u: (3,) unknown amounts: the start, replaced by the solution.
        query: Query of the path search.
        stretch_min: Minimum length of a stretch in one direction.
        longest: Length that the path has to beat.
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
    """True if a path can be driven: no stretch is too short, and curvature steps at cusps only.

    Args:
        pieces: (MAX_PIECES, 4) pieces of the path.
        count: Number of pieces.
        ends: (2,) curvatures at the start and at the goal.
        stretch_min: Minimum length of a stretch in one direction.
    """
    return bool(shortest_stretch(pieces, count) >= stretch_min and meets(pieces, count, ends))


@kernel
def meets(pieces: Floats, count: int, ends: Floats) -> bool:
    """True if curvature steps at cusps only; before and after the path the robot drives forward.

    It steps elsewhere if a stretch between two cusps has shrunk to nothing, so that its neighbours meet.

    Args:
        pieces: (MAX_PIECES, 4) pieces of the path.
        count: Number of pieces.
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
        pieces: (MAX_PIECES, 4) pieces of the path.
        n: Number of pieces.
    """
    shortest, stretch = math.inf, 0.0
    for i in range(n):
        stretch += pieces[i, 0]
        if i + 1 == n or pieces[i + 1, 3] != pieces[i, 3]:
            shortest = min(shortest, stretch)
            stretch = 0.0
    return shortest
