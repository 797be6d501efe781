"""Shortest forward path, also to goals so close that the six words of turning circles are too long.

Two families of profiles join any two curvatures: bend, bend, bend (the middle one may also be a dent between two bends
to one side) and bend, straight, bend. Newton's method starts from a fixed set of deflections, chosen greedily from one
twelve times as large, which finds as short a path in all but a few of a thousand random pairs.
"""

import math

import numpy as np

from touchline.core.angles import TAU
from touchline.core.arcs import unit
from touchline.core.arrays import copy
from touchline.core.jit import borrowing, kernel
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.steering.circles import LIMIT, RADIUS, cost, shortest_word, word_table
from touchline.services.planner.steering.newton3 import solve_three
from touchline.services.planner.steering.profile import AMOUNT, DIRECTION, FAILED, STRAIGHT, UNKNOWN, amount_of
from touchline.services.planner.steering.query import Query
from touchline.services.planner.steering.symmetry import reversed_query
from touchline.services.planner.steering.unit_clothoid import ramp

# A profile must be this much shorter to replace an earlier one, so that ties do not depend on rounding.
TIE = 1e-10
# A word this much longer than the best one is not polished: polishing gains little more than the ramps at its ends.
POLISH_MARGIN = 2.0
BENDS_ONLY, WITH_A_STRAIGHT, WORDS = range(3)

# Deflections (rad) of the bends; in BEND_STRAIGHT_BEND the middle value is a length. All are used mirrored and
# reversed, too.
BENDS = (
    (-2.5, 0.4, -1.2),
    (-0.4, 4.2, -0.05),
    (-4.2, 0.4, -2.5),
    (-1.2, 4.2, -0.05),
    (-2.5, 1.2, -1.2),
    (-0.4, -2.5, 0.05),
    (-4.2, 0.05, -2.5),
    (-4.2, 0.4, -4.2),
    (-4.2, 2.5, -0.05),
    (-0.4, -2.5, -0.05),
    (-0.05, -4.2, 0.05),
    (-2.5, 4.2, -0.4),
    (-4.2, 0.05, -1.2),
    (-4.2, -0.05, -2.5),
    (-2.5, 1.2, -0.4),
    (-4.2, -0.05, -0.4),
    (-1.2, 0.05, -0.4),
    (-4.2, -0.05, -1.2),
    (-1.2, 2.5, -0.4),
)
BEND_STRAIGHT_BEND = (
    (-2.5, 3.0, 0.05),
    (-4.2, 3.0, 0.4),
    (-1.2, 3.0, -0.05),
    (-4.2, 3.0, 2.5),
    (-4.2, 0.5, 0.05),
)
# Beyond this distance, in radii of the turning circle, Newton's method finds the best profile from the words.
HOP_RADII = 5.5


def _both_directions(starts: tuple[tuple[float, float, float], ...], middle: float) -> Floats:
    """Add the mirrored (middle value multiplied by `middle`) and reversed starts, each once."""
    found = [
        start for a, b, c in starts for start in ((a, b, c), (c, b, a), (-a, middle * b, -c), (-c, middle * b, -a))
    ]
    return np.array(list(dict.fromkeys(found)))


_BENDS = _both_directions(BENDS, -1.0)
_STRAIGHTS = _both_directions(BEND_STRAIGHT_BEND, 1.0)
# Bends about the curvatures of the ends, as fractions of the limit.
WIGGLES = np.array([(a * d, b * d, c * d) for d in (0.1, 0.4) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])
STARTS = np.concatenate((_BENDS, _STRAIGHTS))
WITH_STRAIGHT = np.arange(len(STARTS)) >= len(_BENDS)


@kernel
def three_elements(straight_middle: bool) -> Floats:
    """Elements of bend, bend or straight, bend, all forward, each with an unknown of its own."""
    elements = np.zeros((3, 4))
    for i in range(3):
        elements[i, DIRECTION] = 1.0
        elements[i, UNKNOWN] = i
        elements[i, AMOUNT] = 1.0
    elements[1, STRAIGHT] = 1.0 if straight_middle else 0.0
    return elements


@kernel
def shortest_forward(query: Query, amounts: Floats) -> tuple[float, int, bool]:
    """Find the shortest forward path: a profile of three elements, or one of the six words between two ramps.

    Args:
        query: Query of the path search.
        amounts: (3,) amounts of the profile, filled in if the path is one.

    Returns:
        Its length; BENDS_ONLY, WITH_A_STRAIGHT or WORDS; and whether the profile solves the reversed query (see
        symmetry.py).
    """
    ends, c = query.ends, query.circle
    between, turn_between = lead_poses(ends, query.goal, query.turn)
    word = abs(ends[0]) + abs(ends[1]) + shortest_word(between, unit(turn_between), turn_between, c, 1.0)
    best, family = shortest_profile(query, word, word, amounts)
    length, found = shortest_profile(reversed_query(query), word, best, amounts)
    if found != WORDS:
        return length, found, True
    return best, family, False


@kernel
def shortest_profile(query: Query, word: float, best: float, amounts: Floats) -> tuple[float, int]:
    """Find the shortest profile below `best`; return its length and family, or `best` and WORDS.

    Args:
        query: Query of the path search.
        word: Length of the best word.
        best: Length of the best path so far.
        amounts: (3,) amounts of the profile, filled in if there is one.
    """
    family = WORDS
    lead = lead_poses(query.ends, query.goal, query.turn)
    length, found = polished_words(query, lead, word + POLISH_MARGIN, best, amounts)
    if found >= 0:
        best, family = length, found
    if abs(query.goal) < HOP_RADII * query.circle[RADIUS]:
        length, found = short_hop(query, best, amounts)
        if found >= 0:
            best, family = length, found
    return best, family


@kernel
def lead_poses(ends: Floats, goal: complex, turn: float) -> tuple[complex, float]:
    """Goal of a word between a ramp from the start's curvature and a ramp to the goal's.

    Args:
        ends: (2,) curvatures at the start and at the goal.
        goal: Position of the goal relative to the start.
        turn: Its heading (rad).

    Returns:
        Position and heading (rad) of the straight pose before the last ramp, relative to the one after the first.
    """
    to_straight, out_turn = ramp(0.0, ends[0], 0.0)
    from_straight, in_turn = ramp(0.0, 0.0, ends[1])
    between = (goal - unit(turn - in_turn) * from_straight - to_straight) * unit(-out_turn)
    return between, turn - in_turn - out_turn


@kernel
def polished_words(
    query: Query, lead: tuple[complex, float], longest: float, best: float, amounts: Floats
) -> tuple[float, int]:
    """Find the shortest profile below `best` that Newton's method reaches from the words between the ramps.

    Args:
        query: Query of the path search.
        lead: Position and heading (rad) of the words' goal, from `lead_poses`.
        longest: Maximum length of the words.
        best: Length of the best path so far.
        amounts: (3,) amounts of the profile, filled in if there is one.

    Returns:
        Its length and family; `best` and −1 if there is none.
    """
    ends, c = query.ends, query.circle
    limit = c[LIMIT]
    table = np.empty((8, 3))
    word_table(lead[0].real, lead[0].imag, lead[1], c, table)
    family = -1
    u = np.empty(3)
    for row in range(8):
        if table[row, 1] == math.inf:
            continue
        straight = row % 4 < 2
        word = (abs(table[row, 0]), abs(table[row, 1]), abs(table[row, 2]))
        if cost(word, straight, 1.0, c) > longest:
            continue
        # The first bend takes the ramp to straight in, the last one the ramp from straight.
        for i in range(3):
            u[i] = amount_of(table[row, i] + _ramp_deflection(table[row, i], i, ends), limit)
        if straight:
            u[1] = table[row, 1]
        length = attempt(u, straight, query, best)
        if length < best - TIE:
            best, family = length, int(straight)
            copy(u, amounts)
    return best, family


@kernel
def _ramp_deflection(deflection: float, position: int, ends: Floats) -> float:
    k = ends[0] if position == 0 else ends[1] if position == 2 else 0.0
    return k * abs(k) if k * deflection > 0.0 else 0.0


@kernel
def short_hop(query: Query, best: float, amounts: Floats) -> tuple[float, int]:
    """Find the shortest profile below `best` that Newton's method reaches from the fixed starts.

    Args:
        query: Query of the path search.
        best: Length of the best path so far.
        amounts: (3,) amounts of the profile, filled in if there is one.

    Returns:
        Its length, and BENDS_ONLY or WITH_A_STRAIGHT; `best` and −1 if there is none.
    """
    ends, limit = query.ends, query.circle[LIMIT]
    family = -1
    u = np.empty(3)
    for s in range(len(STARTS)):
        straight = WITH_STRAIGHT[s]
        for i in range(3):
            u[i] = STARTS[s, i] if straight and i == 1 else amount_of(STARTS[s, i], limit)
        length = attempt(u, straight, query, best)
        if length < best - TIE:
            best, family = length, int(straight)
            copy(u, amounts)
    for s in range(len(WIGGLES)):
        u[0] = ends[0] + WIGGLES[s, 0] * limit
        u[1] = 0.5 * (ends[0] + ends[1]) + WIGGLES[s, 1] * limit
        u[2] = ends[1] + WIGGLES[s, 2] * limit
        length = attempt(u, False, query, best)
        if length < best - TIE:
            best, family = length, BENDS_ONLY
            copy(u, amounts)
    return best, family


@borrowing
def attempt(u: Floats, straight: bool, query: Query, longest: float) -> float:
    """Length of the profile that Newton's method reaches, with the number of full turns of its start.

    FAILED if there is none, and possibly if it is no shorter than `longest`.

    Args:
        u: (3,) amounts: the start, replaced by the solution.
        straight: Whether the middle element is a straight.
        query: Query of the path search.
        longest: Length of the best path so far.
    """
    ends, goal, limit = query.ends, query.goal, query.circle[LIMIT]
    intended = turn_of(u, straight, ends, limit)
    whole = query.turn + TAU * round((intended - query.turn) / TAU)
    if least_length(ends, goal, whole, limit) >= longest:
        return FAILED
    return float(solve_three(u, straight, ends, limit, goal, whole))


@kernel
def least_length(ends: Floats, goal: complex, turn: float, limit: float) -> float:
    """Lower bound on the length of a path with given curvatures at its ends, given goal and total turn.

    A path of length L, heading θ and maximum curvature κ ends where its turn at κ alone would end, displaced by
    ∫(1 − θ'/κ)·exp(iθ) ds (with the signs of a left turn), which is no longer than ∫(1 − θ'/κ) ds = L − turn/κ.

    Args:
        ends: (2,) curvatures at the start and at the goal.
        goal: Position of the goal relative to the start.
        turn: Turn of the whole path, full turns included (rad).
        limit: Maximum curvature.
    """
    side = 1.0 if turn >= 0.0 else -1.0
    size = abs(turn)
    further = abs(limit * goal - side * 1j * (1.0 - unit(turn)))
    first, last = limit - side * ends[0], limit - side * ends[1]
    # Turn lost on the ramps up to the limit and down again.
    lost = 0.5 * (first * first + last * last)
    if size <= limit * (first + last) - lost:
        lost = 0.0
    least: float = (size + max(further, lost)) / limit
    return least


@kernel
def turn_of(u: Floats, straight_middle: bool, ends: Floats, limit: float) -> float:
    """Turn (rad) of a forward profile of bend, bend or straight, bend.

    Args:
        u: (3,) amounts of its elements.
        straight_middle: Whether the middle element is a straight.
        ends: (2,) curvatures at the start and at the goal.
        limit: Maximum curvature.
    """
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
