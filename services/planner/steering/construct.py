"""Compiled: pieces of the shortest transition, as rows of length, curvature, sharpness and direction.

All `put…` append to a table (MAX_PIECES or more, 4 or 5) of which `n` rows are filled, and return their new number.
"""

import math

import numpy as np

from touchline.core.jit import kernel
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.steering.circles import (
    LIMIT,
    LIMIT_TURN,
    ON_PATH,
    cost,
    left_centres,
    turn_length,
    word_table,
    wrapped,
)
from touchline.services.planner.steering.forward import (
    WITH_A_STRAIGHT,
    WORDS,
    lead_poses,
    shortest_forward,
    three_elements,
)
from touchline.services.planner.steering.profile import DIRECTION, shape, shape_for
from touchline.services.planner.steering.query import Query
from touchline.services.planner.steering.symmetry import reverse_pieces

# No path has more pieces: two ramps and three turns of three.
MAX_PIECES = 12


@kernel
def put(pieces: Floats, n: int, length: float, k: float, sharpness: float, direction: float) -> int:
    """Append a piece, unless it is empty; return the number of pieces.

    Args:
        pieces: (many, 4 or 5) filled in.
        n: Number of pieces so far.
        length: Length; the piece is appended only if this is positive.
        k: Curvature at the beginning.
        sharpness: Change of curvature along it.
        direction: 1 forward, −1 backward.
    """
    if length <= 0.0:
        return n
    pieces[n, 0], pieces[n, 1], pieces[n, 2], pieces[n, 3] = length, k, sharpness, direction
    return n + 1


@kernel
def put_ramp(pieces: Floats, n: int, k_from: float, k_to: float, direction: float) -> int:
    """Append the clothoid of unit sharpness between two curvatures; return the number of pieces.

    Args:
        pieces: (many, 4 or 5) filled in.
        n: Number of pieces so far.
        k_from: Curvature at its beginning.
        k_to: Curvature at its end.
        direction: 1 forward, −1 backward.
    """
    return int(put(pieces, n, abs(k_to - k_from), k_from, math.copysign(1.0, k_to - k_from), direction))


@kernel
def put_turn(pieces: Floats, n: int, deflection: float, direction: float, c: Floats) -> int:
    """Append a turn of a word; return the number of pieces.

    It is clothoid, arc, clothoid; below the limit deflection two flatter clothoids; for no deflection their chord
    (Fraichard and Scheuer 2004, see circles.py).

    Args:
        pieces: (many, 4 or 5) filled in.
        n: Number of pieces so far.
        deflection: Angle by which it turns, left positive (rad).
        direction: 1 forward, −1 backward.
        c: (6,) dimensions of the turning circle.
    """
    size, side = abs(deflection), math.copysign(1.0, deflection)
    if size >= c[LIMIT_TURN]:
        n = put_ramp(pieces, n, 0.0, side * c[LIMIT], direction)
        n = put(pieces, n, (size - c[LIMIT_TURN]) / c[LIMIT], side * c[LIMIT], 0.0, direction)
        return int(put_ramp(pieces, n, side * c[LIMIT], 0.0, direction))
    length = 0.5 * turn_length(size, c)
    peak = deflection / length
    n = put(pieces, n, length, 0.0, peak / length, direction)
    return int(put(pieces, n, length, peak, -peak / length, direction))


@kernel
def word_pieces(x: float, y: float, heading: float, c: Floats, pieces: Floats, n: int) -> int:
    """Append the word between straight ends that `shortest_word` measures; return the number of pieces.

    Args:
        x: x of the goal.
        y: y of the goal.
        heading: Heading of the goal (rad).
        c: (6,) dimensions of the turning circle.
        pieces: (MAX_PIECES or more, 4 or 5) filled in.
        n: Number of pieces so far.
    """
    best, chosen = math.inf, -1
    table = np.empty((8, 3))
    word_table(x, y, heading, c, table)
    for row in range(8):
        if table[row, 1] == math.inf:
            continue
        amounts = (abs(table[row, 0]), abs(table[row, 1]), abs(table[row, 2]))
        length = cost(amounts, row % 4 < 2, 1.0, c)
        if length < best:
            best, chosen = length, row
    single = 0.0
    cos, sin = math.cos(heading), math.sin(heading)
    for side in (1.0, -1.0):
        left_x, left_y, _, _ = left_centres(x, side * y, cos, side * sin, c)
        if left_x * left_x + left_y * left_y <= ON_PATH * ON_PATH:
            deflection = wrapped(side * heading)
            if turn_length(deflection, c) < best:
                best, chosen, single = turn_length(deflection, c), 8, side * deflection
    if abs(y) <= ON_PATH and x >= -ON_PATH and cos > 0.0 and abs(sin) <= ON_PATH and x < best:
        return int(put(pieces, n, x, 0.0, 0.0, 1.0))
    if chosen == 8:
        return int(put_turn(pieces, n, single, 1.0, c))
    first, middle, last = table[chosen]
    n = put_turn(pieces, n, first, 1.0, c)
    n = put(pieces, n, middle, 0.0, 0.0, 1.0) if chosen % 4 < 2 else put_turn(pieces, n, middle, 1.0, c)
    return int(put_turn(pieces, n, last, 1.0, c))


@kernel
def profile_pieces(elements: Floats, u: Floats, ends: Floats, limit: float, pieces: Floats) -> int:
    """Fill in the pieces of a profile; return their number.

    Args:
        elements: (n, 4) of the profile, see profile.py.
        u: (3,) the unknown amounts.
        ends: (2,) curvatures before the first element and after the last one.
        limit: Maximum curvature.
        pieces: (MAX_PIECES, 4 or 5) filled in.
    """
    shaped = shape_for(elements)
    shape(elements, u, ends, limit, shaped)
    extreme, hold = shaped.extreme, shaped.hold
    k, last, n = ends[0], 1.0, 0
    for i in range(len(elements)):
        direction = elements[i, DIRECTION]
        if direction == last:
            n = put_ramp(pieces, n, k, extreme[i], direction)
        n = put(pieces, n, hold[i], extreme[i], 0.0, direction)
        k, last = extreme[i], direction
    if last == 1.0:
        n = put_ramp(pieces, n, k, ends[1], 1.0)
    return int(n)


@kernel
def forward_pieces(query: Query, pieces: Floats) -> int:
    """Fill in the pieces of the path that `shortest_forward` finds; return their number.

    Args:
        query: Query of the path search.
        pieces: (MAX_PIECES, 4 or 5) filled in, in units of the query.
    """
    ends, c = query.ends, query.circle
    amounts = np.empty(3)
    _, family, from_goal = shortest_forward(query, amounts)
    if family != WORDS:
        elements = three_elements(family == WITH_A_STRAIGHT)
        if not from_goal:
            return int(profile_pieces(elements, amounts, ends, c[LIMIT], pieces))
        other_ends = np.array((-ends[1], -ends[0]))
        n = profile_pieces(elements, amounts, other_ends, c[LIMIT], pieces)
        reverse_pieces(pieces, n)
        return int(n)
    between, turn_between = lead_poses(ends, query.goal, query.turn)
    n = put_ramp(pieces, 0, ends[0], 0.0, 1.0)
    n = word_pieces(between.real, between.imag, turn_between, c, pieces, n)
    return int(put_ramp(pieces, n, 0.0, ends[1], 1.0))
