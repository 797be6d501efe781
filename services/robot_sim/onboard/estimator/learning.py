"""What the robot learns beside the filter's states, because it changes too slowly to be one.

**Slope.** Less what the curve asks for, the accelerometer's left axis feels its own bias and gravity's part across:
a_y − v·ω = b + g·(rise_n·cos θ − rise_e·sin θ). As the robot turns, the two come apart: a small Kalman filter of three
states, (b, g·rise_e, g·rise_n), which needs neither speed nor position to be precise.

**Mean slip.** The filter's slips waver about a mean that comes from rolling resistance and the tyres' radii. Each fix
is a sample of it.

Both learn from the oldest tick of the ring, in which nothing will change any more, so that late and reordered messages
lead to the same figures.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from schemas.jit import kernel
from services.robot_sim.onboard.estimator.model import (
    C_MEAN_SLIP_VAR,
    C_Q_RISE,
    C_Q_SIDE_BIAS,
    C_R_MEAN_SLIP,
    C_R_SIDE,
    C_RISE_VAR,
    C_SIDE_BIAS_VAR,
    FIX_USED,
    HEADING,
    IN_LEFT_MEAN,
    IN_RIGHT_MEAN,
    IN_RISE_EAST,
    IN_RISE_NORTH,
    IN_RISE_VAR,
    IN_SIDE,
    LEFT_MEAN,
    LEFT_SLIP,
    MEAN_VAR,
    RIGHT_MEAN,
    RISE_EAST,
    RISE_NORTH,
    RISE_P,
    SIDE_BIAS,
    SPEED,
    YAW_RATE,
)

Floats = NDArray[np.float64]

_EVERY_TICKS = 4  # a divisor of the ring's length; samples nearer to each other say nothing new
_CURVE_SHARE = 0.05  # of the curve's acceleration that may be wrong: slip, and the tyres' settling
_CLIP = 3.0  # σ: a bump or a skid may not teach more than that
_MOVING_MPS = 0.2
_MEAN_SLIP_WALK = 4e-9  # per fix: about a minute is remembered


def start_learning(c: Floats, slow: Floats) -> None:
    """Forget everything: level ground and no slip, as far as is known."""
    slow[:] = 0.0
    slow[RISE_P] = c[C_SIDE_BIAS_VAR]
    slow[[RISE_P + 4, RISE_P + 8]] = c[C_RISE_VAR]
    slow[[MEAN_VAR, MEAN_VAR + 1]] = c[C_MEAN_SLIP_VAR]


@kernel
def lay_down(slow: Floats, z: Floats) -> None:
    """Note in a tick's inputs `z` (INPUTS,) what it is run with."""
    z[IN_RISE_EAST], z[IN_RISE_NORTH] = slow[RISE_EAST], slow[RISE_NORTH]
    z[IN_RISE_VAR] = slow[RISE_P + 4] + slow[RISE_P + 8]
    z[IN_LEFT_MEAN], z[IN_RIGHT_MEAN] = slow[LEFT_MEAN], slow[RIGHT_MEAN]


@kernel
def learn(slot: int, x: Floats, z: Floats, fix: Floats, c: Floats, slow: Floats) -> None:
    """Learn from a tick that is settled.

    Args:
        slot: Of the ring.
        x: (STATES,) the posterior of the tick.
        z: (INPUTS,) its measurements; not a number in IN_RISE_EAST if the filter was not yet running.
        fix: (FIXES,) the fix that is valid in it, if any.
        c: (FIGURES,) constants.
        slow: (SLOW,) updated.
    """
    if math.isnan(z[IN_RISE_EAST]):
        return
    if slot % _EVERY_TICKS == 0 and not math.isnan(z[IN_SIDE]):
        _learn_slope(x, z, c, slow)
    if fix[FIX_USED] > 0.0 and abs(x[SPEED]) > _MOVING_MPS:
        for wheel in range(2):
            slow[MEAN_VAR + wheel] += _MEAN_SLIP_WALK
            gain = slow[MEAN_VAR + wheel] / (slow[MEAN_VAR + wheel] + c[C_R_MEAN_SLIP])
            most = _CLIP * math.sqrt(c[C_R_MEAN_SLIP])
            slow[LEFT_MEAN + wheel] += gain * min(max(x[LEFT_SLIP + wheel] - slow[LEFT_MEAN + wheel], -most), most)
            slow[MEAN_VAR + wheel] *= 1.0 - gain


@kernel
def _learn_slope(x: Floats, z: Floats, c: Floats, slow: Floats) -> None:
    P = slow[RISE_P : RISE_P + 9].reshape(3, 3)
    P[0, 0] += c[C_Q_SIDE_BIAS] * _EVERY_TICKS
    grown = c[C_Q_RISE] * abs(x[SPEED]) * 0.01 * _EVERY_TICKS
    P[1, 1] += grown
    P[2, 2] += grown
    curve = x[SPEED] * x[YAW_RATE]
    h = (1.0, -math.sin(x[HEADING]), math.cos(x[HEADING]))
    innovation = z[IN_SIDE] - curve
    s = c[C_R_SIDE] + (_CURVE_SHARE * curve) ** 2
    gain = np.zeros(3)
    for i in range(3):
        innovation -= h[i] * slow[SIDE_BIAS + i]
        for k in range(3):
            gain[i] += P[i, k] * h[k]
    for i in range(3):
        s += h[i] * gain[i]
    most = _CLIP * math.sqrt(s)
    innovation = min(max(innovation, -most), most)
    for i in range(3):
        slow[SIDE_BIAS + i] += gain[i] * innovation / s
        for k in range(i, 3):
            P[i, k] -= gain[i] * gain[k] / s
            P[k, i] = P[i, k]
