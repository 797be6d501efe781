"""Compiled: the six words of turning circles, LSL RSR LSR RSL LRL RLR.

Dubins, "On curves of minimal length with a constraint on average curvature, and with prescribed initial and terminal
positions and tangents", American Journal of Mathematics 79(3), 1957; for turns with clothoids Fraichard and Scheuer,
"From Reeds and Shepp's to continuous-curvature paths", IEEE T-RO 20(6), 2004. `words.py` has the same for any kind of
turn, word by word, and rounds otherwise: what `ccd` drives comes from there.

A word is (first, middle, last): deflections in [0, 2π) of its turns and the length of its straight. All functions see
the goal from the start pose at the origin heading along +x, and begin to the left; the right is the mirror image.
"""

import math

import numpy as np

from touchline.core.angles import TAU
from touchline.core.jit import kernel
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.steering.unit_clothoid import CURVATURE_CAP, spiral

# As in words.py: deflections this close below a full turn count as none, goals this close to a line or turn as on it.
WRAP_RAD = 1e-12
ON_PATH = 1e-12
# Indices of a circle's dimensions.
LIMIT, LIMIT_TURN, FORWARD, SIDE, RADIUS, CROSSING = range(6)
# ∫₀¹ cos(h(1 − t²)) dt as a series in h² (h: half the deflection), exact to rounding up to h = π/2.
_TERMS = 13


def _chord_series() -> Floats:
    # ∫₀¹ (1 − t²)^n dt = Π 2j/(2j + 1)
    beta, terms = 1.0, []
    for n in range(2 * _TERMS):
        if n:
            beta *= 2.0 * n / (2.0 * n + 1.0)
        if n % 2 == 0:
            terms.append((-1.0) ** (n // 2) * beta / math.factorial(n))
    return np.array(terms)


_CHORD = _chord_series()

# One word: its three amounts.
Amounts = tuple[float, float, float]
NONE: Amounts = (0.0, -1.0, 0.0)


def circle(limit: float) -> Floats:
    """Dimensions (6,) of the turning circle for a maximum curvature in units of unit sharpness.

    They are, in the order of the constants: the curvature that turns keep to, the deflection of two whole clothoids
    (rad), the centre relative to the start of a turn (2), its distance, and the angle (rad) at which turns cross the
    circle.
    """
    limit = min(limit, CURVATURE_CAP)
    half = 0.5 * limit * limit
    centre = spiral(limit) + complex(-math.sin(half), math.cos(half)) / limit
    crossing = math.atan2(centre.real, centre.imag)
    return np.array([limit, limit * limit, centre.real, centre.imag, abs(centre), crossing])


@kernel
def turn_length(deflection: float, c: Floats) -> float:
    """Length of a turn of two clothoids and an arc (Fraichard and Scheuer 2004).

    Below the limit deflection it is that of the flatter pair of clothoids between the same two points of the turning
    circle.

    Args:
        deflection: Angle by which it turns, not negative (rad).
        c: (6,) dimensions of the turning circle.
    """
    if deflection >= c[LIMIT_TURN]:
        return float(c[LIMIT] + deflection / c[LIMIT])
    half = 0.5 * deflection
    square, chord = half * half, 0.0
    for m in range(_TERMS - 1, -1, -1):
        chord = chord * square + _CHORD[m]
    return float(2.0 * c[RADIUS] * math.sin(half + c[CROSSING]) / chord)


@kernel
def wrapped(angle: float) -> float:
    """Wrap an angle (rad) to a deflection in [0, 2π); a rounding error short of a full turn counts as 0."""
    turn = angle - TAU * math.floor(angle / TAU)
    return 0.0 if turn >= TAU - WRAP_RAD else turn


@kernel
def same_side(x: float, y: float, heading: float, c: Floats) -> Amounts:
    """The word LSL (Dubins 1957), or `NONE`.

    Args:
        x: x of the vector from the first to the last left centre.
        y: y of that vector.
        heading: Heading of the goal (rad).
        c: (6,) dimensions of the turning circle.
    """
    straight = math.sqrt(x * x + y * y) - 2.0 * c[FORWARD]
    if straight < 0.0:
        return NONE
    course = math.atan2(y, x)
    return wrapped(course), straight, wrapped(heading - course)


@kernel
def other_side(x: float, y: float, heading: float, c: Floats) -> Amounts:
    """The word LSR (Dubins 1957), or `NONE`.

    Args:
        x: x of the vector from the first left to the last right centre.
        y: y of that vector.
        heading: Heading of the goal (rad).
        c: (6,) dimensions of the turning circle.
    """
    square = x * x + y * y
    if square < 4.0 * c[RADIUS] * c[RADIUS]:
        return NONE
    tangent = math.sqrt(square - 4.0 * c[SIDE] * c[SIDE])
    # The course is that of the vector rotated by atan(2·side / tangent).
    course = math.atan2(y * tangent + x * 2.0 * c[SIDE], x * tangent - y * 2.0 * c[SIDE])
    return wrapped(course), max(tangent - 2.0 * c[FORWARD], 0.0), wrapped(course - heading)


@kernel
def three_turns(x: float, y: float, heading: float, side: float, c: Floats) -> Amounts:
    """The word LRL (Dubins 1957), or `NONE`.

    Args:
        x: x of the vector from the first to the last left centre.
        y: y of that vector.
        heading: Heading of the goal (rad).
        side: Side of the vector on which the middle centre lies: 1 left, −1 right.
        c: (6,) dimensions of the turning circle.
    """
    square = x * x + y * y
    height = 4.0 * c[RADIUS] * c[RADIUS] - 0.25 * square
    if height < 0.0:
        return NONE
    distance = math.sqrt(square)
    along_x, along_y = (x / distance, y / distance) if distance > 0.0 else (1.0, 0.0)
    height = side * math.sqrt(height)
    # From the first centre to the middle one, and from there to the last.
    to_x, to_y = 0.5 * x - along_y * height, 0.5 * y + along_x * height
    touch = 0.5 * math.pi - c[CROSSING]
    first = math.atan2(to_y, to_x) + touch
    second = math.atan2(y - to_y, x - to_x) - touch
    return wrapped(first), wrapped(first - second), wrapped(heading - second)


@kernel
def cost(word: Amounts, straight: bool, weight: float, c: Floats) -> float:
    """Length of a word with its turns weighted; infinite if the word does not exist.

    Args:
        word: Its three amounts.
        straight: Whether the middle one is a straight, not a turn.
        weight: Factor on the length of turns.
        c: (6,) dimensions of the turning circle.
    """
    if word[1] < 0.0:
        return math.inf
    turning: float = turn_length(word[0], c) + turn_length(word[2], c)
    if straight:
        return word[1] + weight * turning
    turning += turn_length(word[1], c)
    return weight * turning


@kernel
def left_centres(x: float, y: float, cos: float, sin: float, c: Floats) -> tuple[float, float, float, float]:
    """Vectors from the first left centre to the last left and to the last right one, as x, y, x, y.

    Args:
        x: x of the goal.
        y: y of the goal.
        cos: Cosine of the heading of the goal.
        sin: Sine of the heading of the goal.
        c: (6,) dimensions of the turning circle.
    """
    # The last centre is goal − direction·conj(centre), or goal − direction·centre.
    left_x, left_y = cos * c[FORWARD] + sin * c[SIDE], sin * c[FORWARD] - cos * c[SIDE]
    right_x, right_y = cos * c[FORWARD] - sin * c[SIDE], sin * c[FORWARD] + cos * c[SIDE]
    x, y = x - c[FORWARD], y - c[SIDE]
    return x - left_x, y - left_y, x - right_x, y - right_y


@kernel
def left_first(goal: complex, facing: complex, heading: float, c: Floats, weight: float, best: float) -> float:
    """Minimum cost of the words that begin to the left, or `best` if that is less.

    Args:
        goal: Position relative to the start.
        facing: Unit vector of its heading.
        heading: Heading as an angle (rad).
        c: (6,) dimensions of the turning circle.
        weight: Factor on the length of turns.
        best: Minimum cost so far.
    """
    left_x, left_y, right_x, right_y = left_centres(goal.real, goal.imag, facing.real, facing.imag, c)
    square = left_x * left_x + left_y * left_y
    if square <= ON_PATH * ON_PATH:
        best = min(best, weight * turn_length(wrapped(heading), c))
    word = same_side(left_x, left_y, heading, c)
    if word[1] < best:
        best = min(best, cost(word, True, weight, c))
    if square <= 16.0 * c[RADIUS] * c[RADIUS]:
        best = min(best, cost(three_turns(left_x, left_y, heading, 1.0, c), False, weight, c))
        best = min(best, cost(three_turns(left_x, left_y, heading, -1.0, c), False, weight, c))
    word = other_side(right_x, right_y, heading, c)
    if word[1] < best:
        best = min(best, cost(word, True, weight, c))
    return best


@kernel
def shortest_word(goal: complex, facing: complex, heading: float, c: Floats, weight: float) -> float:
    """Minimum cost of all words between straight ends.

    Args:
        goal: Position relative to the start.
        facing: Unit vector of its heading.
        heading: Heading as an angle (rad).
        c: (6,) dimensions of the turning circle.
        weight: Factor on the length of turns.
    """
    best = math.inf
    if abs(goal.imag) <= ON_PATH and goal.real >= -ON_PATH and facing.real > 0.0 and abs(facing.imag) <= ON_PATH:
        best = max(goal.real, 0.0)
    best = left_first(goal, facing, heading, c, weight, best)
    return float(left_first(goal.conjugate(), facing.conjugate(), -heading, c, weight, best))


@kernel
def word_table(x: float, y: float, heading: float, c: Floats, table: Floats) -> None:
    """Fill LSL, LSR and both LRL into rows 0 to 3 of a table, their mirror images into rows 4 to 7.

    Rows of words that do not exist have an infinite straight.

    Args:
        x: x of the goal.
        y: y of the goal.
        heading: Heading of the goal (rad).
        c: (6,) dimensions of the turning circle.
        table: (8, 3) filled in: signed deflection (rad), signed deflection or straight, signed deflection.
    """
    cos, sin = math.cos(heading), math.sin(heading)
    for mirrored in range(2):
        s = -1.0 if mirrored else 1.0
        left_x, left_y, right_x, right_y = left_centres(x, s * y, cos, s * sin, c)
        for row in range(4):
            if row == 0:
                word, middle, last = same_side(left_x, left_y, s * heading, c), 1.0, s
            elif row == 1:
                word, middle, last = other_side(right_x, right_y, s * heading, c), 1.0, -s
            else:
                side = 1.0 if row == 2 else -1.0
                word, middle, last = three_turns(left_x, left_y, s * heading, side, c), -s, s
            at = table[4 * mirrored + row]
            at[0], at[1], at[2] = s * word[0], middle * word[1], last * word[2]
            if word[1] < 0.0:
                at[1] = math.inf
