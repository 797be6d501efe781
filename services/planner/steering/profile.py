"""Compiled: paths as curvature profiles with three unknown amounts, found by damped Newton iteration.

A profile is a row of elements, driven forward or backward. A bend climbs to an extreme curvature and, if that is the
limit, holds it; a straight holds zero. Neighbours of one direction are joined by clothoids of full sharpness; between
neighbours of opposite directions is a cusp, where curvature steps. The path's ends count as neighbours of their own
curvature that are driven forward.

An element's amount u is signed (left positive). A bend with r clothoids beside it has its extreme at u clipped to the
limit and holds it for r·(|u| − limit); so its length grows by r per unit of u throughout. A bend between cusps is an
arc of length |u| at the limit. A larger u inserts path at the extreme, where the curvature is k: the rest of the path
is rotated by k per length about that point. That is the whole Jacobian.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.arcs import arc, unit
from touchline.core.arrays import copy
from touchline.core.jit import borrowing, kernel
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.steering.unit_clothoid import ramp

MAX_ELEMENTS = 7
# Columns of an element: 1 for a straight, direction (+1 forward, −1 backward), index of its unknown (−1: none), and its
# amount: the factor on that unknown, or the amount itself.
STRAIGHT, DIRECTION, UNKNOWN, AMOUNT = range(4)
# Maximum change of an amount in a step of Newton's method; tolerance of a solution.
STEP_MAX = 0.7
TOLERANCE = 2e-12
ITERATIONS = 24
# A step that increases the error by this factor is shortened, a few times.
WORSE, SHORTEN, SHORTEN_MAX = 1.05, 0.4, 3
# From this iteration on, the search ends if the error exceeds this much per remaining iteration, as it rarely converges
# then; far goals are allowed more, in proportion to their distance over HOPE_NEAR.
HOPE_FROM, HOPE, HOPE_NEAR = 5, 0.3, 6.0
# Rate of a degenerate bend, whose extreme lies between its neighbours' curvatures.
FLAT = 1e-3
FAILED = math.inf


@kernel
def amount_of(deflection: float, limit: float) -> float:
    """Amount u of a bend between two straights.

    Args:
        deflection: Angle by which it turns, left positive (rad).
        limit: Maximum curvature.
    """
    size = abs(deflection)
    amount = math.sqrt(size) if size < limit * limit else limit + (size - limit * limit) / (2.0 * limit)
    return amount if deflection >= 0.0 else -amount


class Shape(NamedTuple):
    """Extreme curvatures and lengths that follow from the elements' amounts.

    Attributes:
        extreme: (n,) extreme curvature of each element.
        hold: (n,) length at the extreme.
        rate: (n,) added length per unit of the element's amount.
    """

    extreme: Floats
    hold: Floats
    rate: Floats


@kernel
def shape_for(elements: Floats) -> Shape:
    """Create an uninitialised shape for elements (n, 4)."""
    n = len(elements)
    return Shape(np.empty(n), np.empty(n), np.empty(n))


@borrowing
def shape(elements: Floats, u: Floats, ends: Floats, limit: float, out: Shape) -> None:
    """Fill in the shape of elements.

    Args:
        elements: (n, 4) see the constants above.
        u: (3,) unknown amounts.
        ends: (2,) curvatures before the first element and after the last.
        limit: Maximum curvature.
        out: Shape, filled in.
    """
    extreme, hold, rate = out.extreme, out.hold, out.rate
    n = len(elements)
    for i in range(n):
        which = int(elements[i, UNKNOWN])
        amount = elements[i, AMOUNT] * (u[which] if which >= 0 else 1.0)
        hold[i] = amount
        if elements[i, STRAIGHT] == 0.0:
            extreme[i] = min(max(amount, -limit), limit)
        else:
            extreme[i] = 0.0
    for i in range(n):
        if elements[i, STRAIGHT] != 0.0:
            rate[i] = 1.0
            continue
        amount = hold[i]
        side = 1.0 if amount >= 0.0 else -1.0
        ramps, rising = 0.0, 0.0
        direction = elements[i, DIRECTION]
        for j in (i - 1, i + 1):
            inside = 0 <= j < n
            if (elements[j, DIRECTION] if inside else 1.0) != direction:
                continue
            beside = extreme[j] if inside else ends[0 if j < 0 else 1]
            ramps += 1.0
            if extreme[i] > beside or (extreme[i] == beside and side > 0.0):
                rising += 1.0
            else:
                rising -= 1.0
        if ramps == 0.0:
            extreme[i], hold[i], rate[i] = side * limit, abs(amount), side
        else:
            hold[i] = ramps * (abs(amount) - abs(extreme[i]))
            rate[i] = rising if rising != 0.0 else side * FLAT


@borrowing
def shoot(
    elements: Floats, ends: Floats, shaped: Shape, points: NDArray[np.complex128], headings: Floats
) -> tuple[complex, float, float]:
    """Displacement, turn (rad) and length of a profile.

    Args:
        elements: (n, 4) see the constants above.
        ends: (2,) curvatures before the first element and after the last.
        shaped: Their shape.
        points: (n,) beginning of each extreme, filled in.
        headings: (n,) heading there (rad), filled in.
    """
    extreme, hold = shaped.extreme, shaped.hold
    p, heading, length = 0j, 0.0, 0.0
    k, last = ends[0], 1.0
    n = len(elements)
    for i in range(n + 1):
        direction = elements[i, DIRECTION] if i < n else 1.0
        following = extreme[i] if i < n else ends[1]
        if direction == last and following != k:
            step, turn = ramp(heading, direction * k, direction * following)
            p += direction * step
            heading += turn
            length += abs(following - k)
        k, last = following, direction
        if i == n:
            break
        points[i], headings[i] = p, heading
        if hold[i] != 0.0:
            step, turn = arc(heading, direction * k, hold[i])
            p += direction * step
            heading += turn
            length += hold[i]
    return p, heading, length


@kernel
def solve(elements: Floats, u: Floats, ends: Floats, limit: float, goal: complex, turn: float) -> float:
    """Length of the profile that leads to a goal, or FAILED if Newton's method finds none.

    Args:
        elements: (n, 4) see the constants above.
        u: (3,) unknown amounts: the start, replaced by the solution.
        ends: (2,) curvatures before the first element and after the last.
        limit: Maximum curvature.
        goal: Position of the goal relative to the start.
        turn: Turn of the whole profile, full turns included (rad).
    """
    n = len(elements)
    shaped = shape_for(elements)
    extreme, hold, rate = shaped.extreme, shaped.hold, shaped.rate
    points, headings = np.empty(n, np.complex128), np.empty(n)
    moves, turns = np.empty(3, np.complex128), np.empty(3)
    hope = HOPE * max(1.0, abs(goal) / HOPE_NEAR)
    close = TOLERANCE + 4e-16 * abs(goal)
    last_error, shortened, last_u = math.inf, 0, u.copy()
    for iteration in range(ITERATIONS):
        shape(elements, u, ends, limit, shaped)
        p, heading, length = shoot(elements, ends, shaped, points, headings)
        off, off_turn = goal - p, turn - heading
        error = abs(off) + abs(off_turn)
        if iteration >= HOPE_FROM and error > hope * (ITERATIONS - iteration):
            return FAILED
        if error > WORSE * last_error and shortened < SHORTEN_MAX:
            for i in range(3):
                u[i] = last_u[i] + SHORTEN * (u[i] - last_u[i])
            shortened += 1
            continue
        last_error, shortened = error, 0
        copy(u, last_u)
        if error < close:
            for i in range(n):
                if hold[i] < 0.0:
                    return FAILED
            return float(length)
        moves[:], turns[:] = 0.0, 0.0
        for i in range(n):
            which = int(elements[i, UNKNOWN])
            if which < 0:
                continue
            added = elements[i, DIRECTION] * rate[i] * elements[i, AMOUNT]
            moves[which] += added * (unit(headings[i]) + extreme[i] * 1j * (p - points[i]))
            turns[which] += added * extreme[i]
        per_unit, turned = (moves[0], moves[1], moves[2]), (turns[0], turns[1], turns[2])
        found, step0, step1, step2 = newton_step(per_unit, turned, off, off_turn)
        if not found:
            return FAILED
        u[0] += step0
        u[1] += step1
        u[2] += step2
    return FAILED


@kernel
def newton_step(
    moves: tuple[complex, complex, complex], turns: tuple[float, float, float], off: complex, off_turn: float
) -> tuple[bool, float, float, float]:
    """A step of Newton's method in three amounts, by Cramer's rule; no amount changes by more than STEP_MAX.

    Args:
        moves: Displacement of the end per unit of each amount.
        turns: Rotation of the end per unit of each amount (rad).
        off: Vector from the end to the goal.
        off_turn: Missing turn (rad).

    Returns:
        Whether there is a step, and the change of each amount.
    """
    (move0, move1, move2), (turn0, turn1, turn2) = moves, turns
    minor0 = move1.imag * turn2 - move2.imag * turn1
    minor1 = move0.imag * turn2 - move2.imag * turn0
    minor2 = move0.imag * turn1 - move1.imag * turn0
    determinant = move0.real * minor0 - move1.real * minor1 + move2.real * minor2
    if abs(determinant) < 1e-14:
        return False, 0.0, 0.0, 0.0
    x, y, z = off.real, off.imag, off_turn
    yz2, yz1, yz0 = y * turn2 - z * move2.imag, y * turn1 - z * move1.imag, y * turn0 - z * move0.imag
    d0 = (x * minor0 - move1.real * yz2 + move2.real * yz1) / determinant
    d1 = (move0.real * yz2 - x * minor1 - move2.real * yz0) / determinant
    d2 = (-move0.real * yz1 + move1.real * yz0 + x * minor2) / determinant
    largest = max(abs(d0), abs(d1), abs(d2))
    share = 1.0 if largest < STEP_MAX else STEP_MAX / largest
    return math.isfinite(largest), share * d0, share * d1, share * d2
