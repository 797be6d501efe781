"""Compiled: how long the quickest way takes from the end of each painted segment to the beginning of each other one.

For ordering, thousands of ways are timed at once: of every pair of turns on offer (tight and slow, wide and fast) the
shortest of the six words, entered and left by the clothoids that painted arcs need, at the speeds of its limits.
"""

import math

import numpy as np

from schemas.jit import kernel
from services.planner.clothoid import NODES, WEIGHTS, Floats
from services.planner.order_search import Ints
from services.planner.passes import path_time
from services.planner.turns import ContinuousTurn

TAU = 2.0 * math.pi
# Columns of a turn's row.
CENTRE_X, CENTRE_Y, CURVATURE, SHARPNESS, SPIRAL, LIMIT, RADIUS, CROSSING = range(8)
# Columns of an end's row: the pose where the turns begin; between it and the painted curve, of this curvature (1/m) and
# painted at this speed, a clothoid of this sharpness (1/m²) and a straight of this length (m).
X, Y, HEADING, PAINTED_CURVATURE, SPEED, LEAD, PAD = range(7)
PIECES_MAX = 16


def turn_row(turn: ContinuousTurn) -> Floats:
    """A turn as the kernels take it."""
    return np.array(
        (
            turn.centre.real,
            turn.centre.imag,
            turn.curvature,
            turn.sharpness,
            turn.spiral_length,
            turn.limit_deflection,
            turn.radius,
            turn.crossing_angle,
        )
    )


@kernel
def _deflection(angle: float) -> float:
    turn = angle - TAU * math.floor(angle / TAU)
    return 0.0 if turn > TAU - 1e-9 else turn


@kernel
def _half_spiral(deflection: float, turn: Floats) -> float:
    half = 0.5 * deflection
    chord = 0.0
    for i in range(len(NODES)):
        chord += WEIGHTS[i] * math.cos(half * (1.0 - NODES[i] * NODES[i]))
    return turn[RADIUS] * math.sin(half + turn[CROSSING]) / chord


@kernel
def _turn_length(deflection: float, turn: Floats) -> float:
    if deflection < turn[LIMIT]:
        return 2.0 * _half_spiral(deflection, turn)
    return 2.0 * turn[SPIRAL] + (deflection - turn[LIMIT]) / turn[CURVATURE]


@kernel
def _turn_pieces(deflection: float, side: float, turn: Floats, pieces: Floats, count: int) -> int:
    if deflection < turn[LIMIT]:
        length = _half_spiral(deflection, turn)
        top = deflection / length
        pieces[count] = (length, 0.0, side * top / length)
        pieces[count + 1] = (length, side * top, -side * top / length)
        return count + 2
    pieces[count] = (turn[SPIRAL], 0.0, side * turn[SHARPNESS])
    pieces[count + 1] = ((deflection - turn[LIMIT]) / turn[CURVATURE], side * turn[CURVATURE], 0.0)
    pieces[count + 2] = (turn[SPIRAL], side * turn[CURVATURE], -side * turn[SHARPNESS])
    return count + 3


@kernel
def shortest(goal: complex, heading: float, turn: Floats) -> tuple[float, float, float, float, float, float, float]:
    """The shortest word's length, the sides of its three parts (0: straight) and their amounts (rad or m)."""
    best, s0, s1, s2, a0, a1, a2 = np.inf, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    off = abs(math.remainder(heading, TAU))
    if abs(goal.imag) <= 1e-9 and goal.real >= 0.0 and off <= 1e-9:
        return goal.real, 0.0, 0.0, 0.0, goal.real, 0.0, 0.0
    centre = complex(turn[CENTRE_X], turn[CENTRE_Y])
    radius, forward, aside = turn[RADIUS], turn[CENTRE_X], turn[CENTRE_Y]
    for side in (1.0, -1.0):
        z, h = complex(goal.real, side * goal.imag), side * heading
        direction = complex(math.cos(h), math.sin(h))
        left, right = z - direction * centre.conjugate(), z - direction * centre
        between = left - centre
        distance = abs(between)
        straight = distance - 2.0 * forward
        if straight >= 0.0:
            course = math.atan2(between.imag, between.real)
            first, last = _deflection(course), _deflection(h - course)
            length = straight + _turn_length(first, turn) + _turn_length(last, turn)
            if length < best:
                best, s0, s1, s2, a0, a1, a2 = length, side, 0.0, side, first, straight, last
        if distance <= 4.0 * radius:
            along = between / distance if distance > 0.0 else complex(1.0, 0.0)
            height = math.sqrt(max(4.0 * radius * radius - 0.25 * distance * distance, 0.0))
            touch = math.atan2(centre.imag, centre.real)
            for offset in (height, -height):
                middle = centre + 0.5 * between + 1j * along * offset
                there, on = middle - centre, left - middle
                begin = math.atan2(there.imag, there.real) + touch
                end = math.atan2(on.imag, on.real) - touch
                first, second, last = _deflection(begin), _deflection(begin - end), _deflection(h - end)
                length = _turn_length(first, turn) + _turn_length(second, turn) + _turn_length(last, turn)
                if length < best:
                    best, s0, s1, s2, a0, a1, a2 = length, side, -side, side, first, second, last
        between = right - centre
        distance = abs(between)
        if distance >= 2.0 * radius:
            tangent = math.sqrt(distance * distance - 4.0 * aside * aside)
            course = math.atan2(between.imag, between.real) + math.atan2(2.0 * aside, tangent)
            first, last = _deflection(course), _deflection(course - h)
            straight = max(tangent - 2.0 * forward, 0.0)
            length = straight + _turn_length(first, turn) + _turn_length(last, turn)
            if length < best:
                best, s0, s1, s2, a0, a1, a2 = length, side, 0.0, -side, first, straight, last
    return best, s0, s1, s2, a0, a1, a2


@kernel
def way_time(start: Floats, goal: Floats, turn: Floats, limits: Floats, pieces: Floats) -> float:
    """Seconds from a painted end (row of `starts`) to a painted beginning, with the turns of `turn`."""
    c, s = math.cos(start[HEADING]), math.sin(start[HEADING])
    dx, dy = goal[X] - start[X], goal[Y] - start[Y]
    seen = complex(c * dx + s * dy, c * dy - s * dx)
    _, s0, s1, s2, a0, a1, a2 = shortest(seen, goal[HEADING] - start[HEADING], turn)
    count = 0
    k = start[PAINTED_CURVATURE]
    if k != 0.0:
        pieces[0] = (abs(k) / start[LEAD], k, -math.copysign(start[LEAD], k))
        count = 1
    if start[PAD] > 0.0:
        pieces[count] = (start[PAD], 0.0, 0.0)
        count += 1
    for side, amount in ((s0, a0), (s1, a1), (s2, a2)):
        if side != 0.0:
            count = _turn_pieces(amount, side, turn, pieces, count)
        elif amount > 0.0:
            pieces[count] = (amount, 0.0, 0.0)
            count += 1
    if goal[PAD] > 0.0:
        pieces[count] = (goal[PAD], 0.0, 0.0)
        count += 1
    k = goal[PAINTED_CURVATURE]
    if k != 0.0:
        pieces[count] = (abs(k) / goal[LEAD], 0.0, math.copysign(goal[LEAD], k))
        count += 1
    return path_time(pieces, count, start[SPEED], goal[SPEED], limits)


@kernel
def way_times(
    starts: Floats, goals: Floats, turns: Floats, limits: Floats, pairs: Ints, seconds: Floats, choice: Ints
) -> None:
    """Fill the seconds and the best turn of every pair (start, goal).

    `starts` and `goals` are (turns, ends, 7), `turns` (turns, 8), `pairs` (n, 2), `seconds` and `choice` (n,).
    """
    pieces = np.empty((PIECES_MAX, 3))
    for p in range(len(pairs)):
        seconds[p] = np.inf
        for k in range(len(turns)):
            time = way_time(starts[k, pairs[p, 0]], goals[k, pairs[p, 1]], turns[k], limits, pieces)
            if time < seconds[p]:
                seconds[p], choice[p] = time, k
