"""Newton's method in three unknowns for forward profiles: bend, bend or straight, bend.

`profile.solve` specialised to three elements that are all driven forward, each with an unknown of its own: without
tables, and with each clothoid's series evaluated once. Short hops spend nearly all their time here.
"""

import math

from touchline.core.arcs import arc, unit
from touchline.core.jit import kernel
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.steering.profile import (
    FAILED,
    FLAT,
    HOPE,
    HOPE_FROM,
    HOPE_NEAR,
    ITERATIONS,
    SHORTEN,
    SHORTEN_MAX,
    TOLERANCE,
    WORSE,
    newton_step,
)
from touchline.services.planner.steering.unit_clothoid import spiral


@kernel
def _rate(amount: float, extreme: float, before: float, after: float) -> float:
    """Added length per unit of amount of a bend between two curvatures (see `profile.shape`)."""
    up = amount >= 0.0
    first = extreme > before or (extreme == before and up)
    second = extreme > after or (extreme == after and up)
    if first == second:
        return 2.0 if first else -2.0
    return FLAT if up else -FLAT


@kernel
def _ramp(p: complex, heading: float, k: float, at: complex, k_to: float, to: complex) -> tuple[complex, float]:
    """Position and heading after the clothoid from `k` to `k_to`, given `spiral` of both (see `unit_clothoid.ramp`)."""
    if k_to == k:
        return p, heading
    turn = 0.5 * (k + k_to) * abs(k_to - k)
    if k_to > k:
        return p + unit(heading - 0.5 * k * k) * (to - at), heading + turn
    return p + unit(heading + 0.5 * k * k) * (at - to).conjugate(), heading + turn


@kernel
def _held(p: complex, heading: float, k: float, length: float) -> tuple[complex, float]:
    """Position and heading at the end of an arc or line."""
    if length == 0.0:
        return p, heading
    step, turn = arc(heading, k, length)
    return p + step, heading + turn


@kernel
def solve_three(u: Floats, straight: bool, ends: Floats, limit: float, goal: complex, turn: float) -> float:
    """Length of the profile of bend, bend or straight, bend to a goal, or FAILED if none is found.

    Args:
        u: (3,) amounts: the start, replaced by the solution.
        straight: Whether the middle element is a straight.
        ends: (2,) curvatures at the start and at the goal.
        limit: Maximum curvature.
        goal: Position of the goal relative to the start.
        turn: Turn of the whole profile, full turns included (rad).
    """
    u0, u1, u2 = u[0], u[1], u[2]
    l0, l1, l2 = u0, u1, u2
    k_from, k_to = ends[0], ends[1]
    from_, to = spiral(k_from), spiral(k_to)
    hope = HOPE * max(1.0, abs(goal) / HOPE_NEAR)
    close = TOLERANCE + 4e-16 * abs(goal)
    last_error, shortened = math.inf, 0
    for iteration in range(ITERATIONS):
        k0 = min(max(u0, -limit), limit)
        k1 = 0.0 if straight else min(max(u1, -limit), limit)
        k2 = min(max(u2, -limit), limit)
        hold0, hold2 = 2.0 * (abs(u0) - abs(k0)), 2.0 * (abs(u2) - abs(k2))
        hold1 = u1 if straight else 2.0 * (abs(u1) - abs(k1))
        s0, s1, s2 = spiral(k0), 0j if straight else spiral(k1), spiral(k2)
        p0, h0 = _ramp(0j, 0.0, k_from, from_, k0, s0)
        p, h = _held(p0, h0, k0, hold0)
        p1, h1 = _ramp(p, h, k0, s0, k1, s1)
        p, h = _held(p1, h1, k1, hold1)
        p2, h2 = _ramp(p, h, k1, s1, k2, s2)
        p, h = _held(p2, h2, k2, hold2)
        p, h = _ramp(p, h, k2, s2, k_to, to)
        off, off_turn = goal - p, turn - h
        error = abs(off) + abs(off_turn)
        if iteration >= HOPE_FROM and error > hope * (ITERATIONS - iteration):
            return FAILED
        if error > WORSE * last_error and shortened < SHORTEN_MAX:
            u0, u1, u2 = l0 + SHORTEN * (u0 - l0), l1 + SHORTEN * (u1 - l1), l2 + SHORTEN * (u2 - l2)
            shortened += 1
            continue
        last_error, shortened = error, 0
        l0, l1, l2 = u0, u1, u2
        if error < close:
            if hold1 < 0.0:
                return FAILED
            u[0], u[1], u[2] = u0, u1, u2
            length: float = abs(k0 - k_from) + hold0 + abs(k1 - k0) + hold1 + abs(k2 - k1) + hold2 + abs(k_to - k2)
            return length
        # Derivative of the end by each amount (see profile.py).
        r0 = _rate(u0, k0, k_from, k1)
        r1 = 1.0 if straight else _rate(u1, k1, k0, k2)
        r2 = _rate(u2, k2, k1, k_to)
        m0 = r0 * (unit(h0) + k0 * 1j * (p - p0))
        m1 = r1 * (unit(h1) + k1 * 1j * (p - p1))
        m2 = r2 * (unit(h2) + k2 * 1j * (p - p2))
        found, d0, d1, d2 = newton_step((m0, m1, m2), (r0 * k0, r1 * k1, r2 * k2), off, off_turn)
        if not found:
            return FAILED
        u0, u1, u2 = u0 + d0, u1 + d1, u2 + d2
    return FAILED
