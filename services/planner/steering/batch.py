"""Lengths of the forward ways between many poses at once.

Poses are rows of x (m), y (m), heading (rad) and curvature (1/m). With `short_hops` the lengths are those of
`Steering.between`. Without, they are those of the shortest of the six words with ramps to and from straight ends: less
than a microsecond each, and the same or a few per cent more but for goals within five turning radii. A matrix of words,
with the near pairs measured once more as hops, is what an ordering of many segments needs.
"""

import math

import numpy as np

from schemas.jit import kernel
from services.planner.clothoid import Floats
from services.planner.steering.circles import circle, shortest_word
from services.planner.steering.forward import shortest_forward
from services.planner.steering.reversing import MAX_CUSPS, STRETCH_MIN_M, shortest_reversing
from services.planner.steering.spiral import steep_ramp, unit

# Columns of a pose's figures: position, direction, heading, curvature, and the length of ramps that they leave out.
_X, _Y, _COS, _SIN, _HEADING, _CURVATURE, _LEFT_OUT = range(7)


def lengths(
    starts: Floats,
    goals: Floats,
    curvature_max_1pm: float,
    sharpness_max_1pm2: float,
    *,
    short_hops: bool = True,
    turn_weight: float = 1.0,
) -> Floats:
    """Lengths (m) (n, m) of the ways from every start (n, 4) to every goal (m, 4).

    Words can be chosen and measured by time instead of length: the length of their turns counts `turn_weight` times,
    which is the speed on the straight over that in turns; divide the result by the former. Hops ignore it.
    """
    root, c, left, reached = _prepared(starts, goals, curvature_max_1pm, sharpness_max_1pm2, short_hops)
    out = np.empty((len(starts), len(goals)))
    _fill_matrix(left, reached, c, short_hops, turn_weight, out)
    return out / root


def pair_lengths(
    starts: Floats,
    goals: Floats,
    curvature_max_1pm: float,
    sharpness_max_1pm2: float,
    *,
    short_hops: bool = True,
    turn_weight: float = 1.0,
) -> Floats:
    """Lengths (m) (n,) of the ways from each start (n, 4) to the goal (n, 4) in the same row; see `lengths`."""
    root, c, left, reached = _prepared(starts, goals, curvature_max_1pm, sharpness_max_1pm2, short_hops)
    out = np.empty(len(starts))
    _fill_pairs(left, reached, c, short_hops, turn_weight, out)
    return out / root


def cusp_lengths(starts: Floats, goals: Floats, curvature_max_1pm: float, sharpness_max_1pm2: float) -> Floats:
    """Lengths (m) (n, MAX_CUSPS + 1) of the shortest way with each number of cusps between the poses of each row.

    Column 0, without cusps, is `pair_lengths` with short hops; infinite where there is no way with so many. They are
    those of `Steering.ways` without room, of which a longer one with more cusps is left out. About a millisecond each.
    """
    root, c, left, reached = _prepared(starts, goals, curvature_max_1pm, sharpness_max_1pm2, True)
    out = np.empty((len(starts), MAX_CUSPS + 1))
    _fill_cusps(left, reached, c, STRETCH_MIN_M * root, out)
    return out / root


def _prepared(
    starts: Floats, goals: Floats, curvature_max_1pm: float, sharpness_max_1pm2: float, short_hops: bool
) -> tuple[float, Floats, Floats, Floats]:
    """The unit, the circle, and the figures of starts and goals: words begin and end straight, hops at most capped."""
    root = math.sqrt(sharpness_max_1pm2)
    c = circle(curvature_max_1pm / root)
    cap = float(c[0]) if short_hops else 0.0
    return root, c, _figures(starts, root, cap, leaving=True), _figures(goals, root, cap, leaving=False)


def _figures(poses: Floats, root: float, curvature_cap: float, *, leaving: bool) -> Floats:
    table = np.empty((len(poses), 7))
    _fill_figures(np.asarray(poses, dtype=np.float64), root, curvature_cap, leaving, table)
    return table


@kernel
def _fill_figures(poses: Floats, root: float, curvature_cap: float, leaving: bool, table: Floats) -> None:
    """Figures (n, 7) of poses (n, 4) in units of unit sharpness, after ramps (before, if not `leaving`) to the cap."""
    for i in range(len(poses)):
        k, heading = poses[i, 3] / root, poses[i, 2]
        capped = math.copysign(min(abs(k), curvature_cap), k)
        move, turn = steep_ramp(k, capped)
        if not leaving:
            # A ramp into a goal is the mirror image, seen from the goal, of the ramp out of a start of its curvature.
            move, turn = -move.conjugate(), -turn
        point = complex(poses[i, 0], poses[i, 1]) * root + unit(heading) * move
        heading += turn
        table[i, _X], table[i, _Y] = point.real, point.imag
        table[i, _COS], table[i, _SIN] = math.cos(heading), math.sin(heading)
        table[i, _HEADING], table[i, _CURVATURE], table[i, _LEFT_OUT] = heading, capped, abs(k - capped)


@kernel
def _fill_matrix(starts: Floats, goals: Floats, c: Floats, short_hops: bool, weight: float, out: Floats) -> None:
    for i in range(len(starts)):
        for j in range(len(goals)):
            out[i, j] = _length(starts[i], goals[j], c, short_hops, weight)


@kernel
def _fill_pairs(starts: Floats, goals: Floats, c: Floats, short_hops: bool, weight: float, out: Floats) -> None:
    for i in range(len(starts)):
        out[i] = _length(starts[i], goals[i], c, short_hops, weight)


@kernel
def _fill_cusps(starts: Floats, goals: Floats, c: Floats, stretch_min: float, out: Floats) -> None:
    amounts, rows = np.empty((MAX_CUSPS + 1, 3)), np.empty(MAX_CUSPS + 1, np.int64)
    for i in range(len(starts)):
        s, g = starts[i], goals[i]
        ends = np.array([s[_CURVATURE], g[_CURVATURE]])
        z, turn = _seen(s, g), g[_HEADING] - s[_HEADING]
        shortest_reversing(ends, z, turn, c[0], stretch_min, out[i], amounts, rows)
        out[i, 0], _ = shortest_forward(ends, z, turn, c, True, amounts[0])
        out[i] += s[_LEFT_OUT] + g[_LEFT_OUT]


@kernel
def _seen(s: Floats, g: Floats) -> complex:
    """The goal's position in the frame of the start."""
    dx, dy = g[_X] - s[_X], g[_Y] - s[_Y]
    return complex(dx * s[_COS] + dy * s[_SIN], dy * s[_COS] - dx * s[_SIN])


@kernel
def _length(s: Floats, g: Floats, c: Floats, short_hops: bool, weight: float) -> float:
    """Length of one way in units of unit sharpness, for the figures of its start and goal."""
    z = _seen(s, g)
    turn = g[_HEADING] - s[_HEADING]
    left_out = s[_LEFT_OUT] + g[_LEFT_OUT]
    if short_hops:
        ends, amounts = np.array([s[_CURVATURE], g[_CURVATURE]]), np.empty(3)
        length, _ = shortest_forward(ends, z, turn, c, True, amounts)
        return float(left_out + length)
    cos, sin = g[_COS] * s[_COS] + g[_SIN] * s[_SIN], g[_SIN] * s[_COS] - g[_COS] * s[_SIN]
    return float(weight * left_out + shortest_word(z.real, z.imag, cos, sin, turn, c, weight))
