"""Words of turning circles with cusps: further starts for Newton's method (see reversing.py).

The families are those of hybrid curvature (HC) steer: the words of Reeds and Shepp and a few more, where a turn begins
and ends with a clothoid, but at a cusp at full curvature. A bend's arc lies on a circle of radius 1/κ, so a word
follows from its joints alone: in the frame of a joint, the offset from one circle's centre to the next is fixed.
A word whose bends all reach the limit is a path already; from the others Newton's method finds one.

Source: Banzhaf, Palmieri, Nienhüser, Schmidt, Knoop, Zöllner, "Hybrid curvature steer: a novel extend function for
sampling-based nonholonomic motion planning in tight environments", ITSC 2017. Names: C circle, s side (left 1, right
−1), d direction of travel, F and S the forward and sideways offset of a turn's centre from its straight beginning.
"""

import math
from itertools import product
from typing import NamedTuple

import numpy as np

from touchline.core.arcs import unit
from touchline.core.jit import kernel
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.steering.circles import FORWARD, LIMIT, SIDE, wrapped
from touchline.services.planner.steering.patterns import QUARTER, bend_amount, cusps_of, elements_of, ramps_beside
from touchline.services.planner.steering.profile import AMOUNT, DIRECTION, MAX_ELEMENTS, STRAIGHT, UNKNOWN
from touchline.services.planner.steering.query import Query
from touchline.services.planner.steering.unit_clothoid import ramp

# Rules for the joints' headings: from the sides of a triangle (three bends, or four whose middle turns cancel out), for
# four bends whose middle turns add up, or from the tangent of a straight.
TRIANGLE, CANCELLING, ADDING, TANGENT = range(4)
# Directions of three elements, except all forward.
WITH_CUSPS = ["".join(directions) for directions in product("+-", repeat=3)][1:]


class Family(NamedTuple):
    """Element kinds, directions (see patterns.py), sides of the bends, rule for headings, and number of solutions."""

    kinds: str
    directions: str
    sides: tuple[int, ...]
    rule: int
    branches: int


def _families() -> list[Family]:
    found = []
    for side in (1, -1):
        found += [Family("BBB", directions, (side, -side, side), TRIANGLE, 2) for directions in WITH_CUSPS]
        alternating = (side, -side, side, -side)
        found += [Family("BBBB", d, alternating, CANCELLING, 2) for d in ("+--+", "-++-")]
        found += [Family("BBBB", d, alternating, ADDING, 4) for d in ("++--", "--++")]
        for last in (1, -1):
            found += [Family("BSB", directions, (side, 0, last), TANGENT, 2) for directions in WITH_CUSPS]
            found += [Family("BSQB", d, (side, 0, last, -last), TANGENT, 2) for d in ("+++-", "---+")]
            found += [Family("BQSB", d, (-side, side, 0, last), TANGENT, 2) for d in ("-+++", "+---")]
            found += [Family("BQSQB", d, (-side, side, 0, last, -last), TANGENT, 2) for d in ("-+++-", "+---+")]
    return [ended for family in found for ended in _ended(family)]


def _ended(family: Family) -> list[Family]:
    """Return a family and, if it begins or ends backward, its variants with a clothoid at that end."""
    families = [family]
    if family.directions[0] == "-":
        families += [
            w._replace(kinds="Z" + w.kinds, directions="-" + w.directions, sides=(0, *w.sides)) for w in families
        ]
    if family.directions[-1] == "-":
        families += [
            w._replace(kinds=w.kinds + "Z", directions=w.directions + "-", sides=(*w.sides, 0)) for w in families
        ]
    return families


FAMILIES = _families()

COUNTS = np.array([len(family.kinds) for family in FAMILIES])
ELEMENTS = np.array([elements_of(family.kinds, family.directions) for family in FAMILIES])
SIDES = np.array([family.sides + (0,) * (MAX_ELEMENTS - len(family.sides)) for family in FAMILIES], dtype=np.float64)
RULES = np.array([family.rule for family in FAMILIES])
BRANCHES = np.array([family.branches for family in FAMILIES])
LEADS = np.array([int(family.kinds[0] == "Z") for family in FAMILIES])
BENDS = np.array([len(family.kinds.strip("Z")) for family in FAMILIES])
CUSPS = np.array([cusps_of(family.directions) for family in FAMILIES])


@kernel
def word(family: int, branch: int, query: Query, elements: Floats, u: Floats) -> float:
    """Length of a word, exact if all its bends reach the limit; infinite if the word does not exist.

    Args:
        family: Row of `FAMILIES`.
        branch: Number of the solution.
        query: Query of the path search.
        elements: (n, 4) elements of the family; the amounts of fixed bends are filled in.
        u: (3,) unknowns, filled in.
    """
    ends, turn, c = query.ends, query.turn, query.circle
    begin, n = LEADS[family], BENDS[family]
    bends, sides = elements[begin : begin + n], SIDES[family, begin:]
    # Headings at both ends of each bend, as if its clothoids led from and to straights.
    into, out = np.empty(n), np.empty(n)
    first, into[0] = end_circle(ends[0], sides[0], bends[0, DIRECTION], begin > 0, c)
    # Seen backward, the goal is a start from which bends turn to the other side.
    last, out[n - 1] = end_circle(-ends[1], -sides[n - 1], bends[n - 1, DIRECTION], begin + n < len(elements), c)
    out[n - 1] += turn
    across = query.goal - unit(turn) * last - first
    straight = 0.0
    if RULES[family] == TRIANGLE:
        found = _triangle(across, joint(bends, sides, 0, c), joint(bends, sides, 1, c), branch, out)
    elif RULES[family] == CANCELLING:
        ends_joint = joint(bends, sides, 0, c) + joint(bends, sides, 2, c)
        found = _triangle(across, ends_joint, joint(bends, sides, 1, c), branch, out)
        out[2] = out[0]
    elif RULES[family] == ADDING:
        found = _adding(across, joint(bends, sides, 0, c), sides[0], c[LIMIT], branch, out)
    else:
        straight = _tangent(across, bends, sides, c, branch, out)
        found = straight >= 0.0
    if not found:
        return math.inf
    for i in range(1, n):
        into[i] = out[i - 1]
    length = straight
    for i in range(n - 1, -1, -1):
        which = int(bends[i, UNKNOWN])
        if bends[i, STRAIGHT] != 0.0:
            u[which] = straight
            continue
        ramps = ramps_beside(elements, begin + i)
        deflection = wrapped(bends[i, DIRECTION] * sides[i] * (out[i] - into[i]))
        amount = bend_amount(deflection, ramps, c[LIMIT])
        length += amount if ramps == 0 else ramps * amount
        if which < 0:
            bends[i, AMOUNT] = sides[i] * amount
        else:
            u[which] = sides[i] * amount
    return length


@kernel
def end_circle(k: float, side: float, direction: float, clothoid: bool, c: Floats) -> tuple[complex, float]:
    """Centre of the first bend's circle, and the heading (rad) at which it would begin if it began straight.

    Args:
        k: Curvature before the bend, if it begins forward.
        side: Side to which it turns: 1 left, −1 right.
        direction: 1 forward, −1 backward.
        clothoid: Whether a bend that begins backward begins with a clothoid from straight, not at the limit.
        c: (6,) dimensions of the turning circle.
    """
    if direction < 0.0 and clothoid:
        return complex(-c[FORWARD], side * c[SIDE]), 0.0
    if direction < 0.0:
        return complex(0.0, side / c[LIMIT]), 0.0
    move, turn = ramp(0.0, k, side * c[LIMIT])
    return move + unit(turn) * complex(0.0, side / c[LIMIT]), turn - 0.5 * side * c[LIMIT] * c[LIMIT]


@kernel
def joint(elements: Floats, sides: Floats, i: int, c: Floats) -> complex:
    """Vector from the centre of a bend's circle to that of the next, which turns to the other side.

    It is given in the frame of the heading of their joint: a cusp at full curvature, or the point of zero curvature
    between the clothoids of the two.

    Args:
        elements: (n, 4) bends, see profile.py.
        sides: (n or more,) sides to which they turn: 1 left, −1 right.
        i: Index of the first of the two bends.
        c: (6,) dimensions of the turning circle.
    """
    direction = elements[i, DIRECTION]
    if elements[i + 1, DIRECTION] == direction:
        return 2.0 * complex(direction * c[FORWARD], -sides[i] * c[SIDE])
    return complex(0.0, -2.0 * sides[i] / c[LIMIT])


@kernel
def _angle(z: complex) -> float:
    return math.atan2(z.imag, z.real)


@kernel
def _triangle(across: complex, first: complex, second: complex, branch: int, out: Floats) -> bool:
    """Headings by which two joint vectors have to be rotated so that their sum is `across`; false if there are none."""
    a, b, distance = abs(first), abs(second), abs(across)
    if distance > a + b or distance < abs(a - b) or distance == 0.0:
        return False
    cosine = min(max((a * a + distance * distance - b * b) / (2.0 * a * distance), -1.0), 1.0)
    sine = math.sqrt(1.0 - cosine * cosine)
    along = across * complex(cosine, sine if branch == 0 else -sine) * (a / distance)
    out[0], out[1] = _angle(along * first.conjugate()), _angle((across - along) * second.conjugate())
    return True


@kernel
def _adding(across: complex, first: complex, side: float, limit: float, branch: int, out: Floats) -> bool:
    """Joint headings of four bends with a cusp in the middle, which turn by the same angle on either side of it.

    Rotated back by that angle, φ, the first joint, and its mirror image for the last, leave a sideways distance only:
    across = exp(iθ)·2i·(Im(first·exp(−iφ)) + s/κ).
    """
    sideward = abs(across) if branch < 2 else -abs(across)
    sine = (0.5 * sideward - side / limit) / abs(first)
    if abs(sine) > 1.0:
        return False
    turned = math.asin(sine)
    turned = _angle(first) - (turned if branch % 2 == 0 else math.pi - turned)
    out[1] = _angle(across * complex(0.0, -sideward))
    out[0], out[2] = out[1] - turned, out[1] + turned
    return True


@kernel
def _tangent(across: complex, elements: Floats, sides: Floats, c: Floats, branch: int, out: Floats) -> float:
    """Joint headings of bends with a straight; returns the straight's length, negative if there is none."""
    n = len(elements)
    at = 1 if elements[1, STRAIGHT] != 0.0 else 2
    direction = elements[at, DIRECTION]
    # From circle to circle without the straight, in its frame. A quarter turn and the cusp beyond lie along it.
    beside = _tangent_point(direction, elements[at + 1, DIRECTION], sides[at + 1], c)
    beside += _tangent_point(direction, elements[at - 1, DIRECTION], -sides[at - 1], c)
    beside += direction * (n - 3) * 2.0 / c[LIMIT]
    square = abs(across) ** 2 - beside.imag**2
    if square < 0.0:
        return -1.0
    forward = math.sqrt(square) if branch == 0 else -math.sqrt(square)
    heading = _angle(across * complex(forward, -beside.imag))
    out[at - 1] = out[at] = heading
    if at == 2:
        out[0] = heading - direction * sides[1] * QUARTER
    if at + 2 < n:
        out[at + 1] = heading + direction * sides[at + 1] * QUARTER
    return float(direction * (forward - beside.real))


@kernel
def _tangent_point(straight: float, bend: float, side: float, c: Floats) -> complex:
    """Centre of a bend that follows a straight, relative to the straight's end."""
    return complex(straight * c[FORWARD], side * c[SIDE]) if bend == straight else complex(0.0, side / c[LIMIT])
