"""Lengths of the ways between many poses at once."""

import cmath
import math

import numpy as np
from numpy.typing import NDArray

from schemas.jit import kernel
from services.planner.clothoid import Floats, Piece
from services.planner.steering.circles import circle, shortest_word
from services.planner.steering.forward import shortest_forward

# Columns of a pose's figures: position, direction, heading, curvature, and the length that they leave out.
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
    """Lengths (m) (n, m) of the forward ways from every start (n, 4) to every goal (m, 4).

    Rows are x (m), y (m), heading (rad), curvature (1/m). With `short_hops` they are those of `Steering.between`;
    without, of the six words (with ramps to and from straight ends), which takes a small fraction of a microsecond each
    and is the same but for goals within about five turning radii. Without short hops the turns' length can be counted
    `turn_weight` times, for a cost in time: divide by the speed on the straight.
    """
    root = math.sqrt(sharpness_max_1pm2)
    c = circle(curvature_max_1pm / root)
    if short_hops:
        left = _figures(starts, root, float(c[0]), leaving=True)
        reached = _figures(goals, root, float(c[0]), leaving=False)
        result = np.asarray(_hop_matrix(left, reached, c))
    else:
        left = _figures(starts, root, 0.0, leaving=True)
        reached = _figures(goals, root, 0.0, leaving=False)
        result = np.asarray(_word_matrix(left, reached, c, turn_weight))
    return result / root


def _figures(poses: Floats, root: float, curvature_cap: float, *, leaving: bool) -> Floats:
    """Figures (n, 7) of poses (n, 4) in units of unit sharpness, after ramps (before, if not `leaving`) to the cap."""
    table = np.empty((len(poses), 7))
    cache: dict[float, tuple[complex, float, float, float]] = {}
    for row, (x, y, heading, curvature) in zip(table, poses.tolist(), strict=True):
        k = curvature / root
        if k not in cache:
            cache[k] = _ramp_to_cap(k, curvature_cap)
        move, turn, capped, left_out = cache[k]
        # Before a goal comes the mirror image of what follows a start of its curvature, seen in the mirror from it.
        point = complex(x, y) * root + cmath.rect(1.0, heading) * (move if leaving else -move.conjugate())
        heading += turn if leaving else -turn
        row[:] = point.real, point.imag, math.cos(heading), math.sin(heading), heading, capped, left_out
    return table


def _ramp_to_cap(k: float, cap: float) -> tuple[complex, float, float, float]:
    """Displacement, turn, curvature after it, and length of the ramp from curvature `k` down to within ±`cap`."""
    capped = math.copysign(min(abs(k), cap), k)
    ramp = Piece(abs(k - capped), k, math.copysign(1.0, -k))
    return ramp.displacement_at(ramp.length_m), ramp.turn_at(ramp.length_m), capped, ramp.length_m


@kernel
def _word_matrix(starts: Floats, goals: Floats, c: Floats, weight: float) -> NDArray[np.float64]:
    out = np.empty((len(starts), len(goals)))
    for i in range(len(starts)):
        s = starts[i]
        for j in range(len(goals)):
            g = goals[j]
            dx, dy = g[_X] - s[_X], g[_Y] - s[_Y]
            out[i, j] = weight * (s[_LEFT_OUT] + g[_LEFT_OUT]) + shortest_word(
                dx * s[_COS] + dy * s[_SIN],
                dy * s[_COS] - dx * s[_SIN],
                g[_COS] * s[_COS] + g[_SIN] * s[_SIN],
                g[_SIN] * s[_COS] - g[_COS] * s[_SIN],
                g[_HEADING] - s[_HEADING],
                c,
                weight,
            )
    return out


@kernel
def _hop_matrix(starts: Floats, goals: Floats, c: Floats) -> NDArray[np.float64]:
    out = np.empty((len(starts), len(goals)))
    ends, amounts = np.empty(2), np.empty(3)
    for i in range(len(starts)):
        s = starts[i]
        for j in range(len(goals)):
            g = goals[j]
            dx, dy = g[_X] - s[_X], g[_Y] - s[_Y]
            goal = complex(dx * s[_COS] + dy * s[_SIN], dy * s[_COS] - dx * s[_SIN])
            ends[0], ends[1] = s[_CURVATURE], g[_CURVATURE]
            length, _ = shortest_forward(ends, goal, g[_HEADING] - s[_HEADING], c, True, amounts)
            out[i, j] = s[_LEFT_OUT] + g[_LEFT_OUT] + length
    return out
