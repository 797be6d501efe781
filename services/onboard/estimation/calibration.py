"""Calibration: figures that change too slowly to be states of the filter and are learned beside it.

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
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.jit import kernel
from touchline.services.onboard.estimation.standing import contradicts
from touchline.services.onboard.filter_model import (
    C_MEAN_SLIP_VAR,
    C_Q_RISE,
    C_Q_SIDE_BIAS,
    C_R_MEAN_SLIP,
    C_R_SIDE,
    C_RISE_VAR,
    C_SIDE_BIAS_VAR,
    ERROR_MEAN,
    FIX_USED,
    HEADING,
    IN_ERROR_MEAN,
    IN_RISE_EAST,
    IN_RISE_NORTH,
    IN_RISE_VAR,
    IN_SIDE,
    IN_STILL,
    MEAN_VAR,
    ODOMETRY_ERROR,
    P_BIAS,
    P_BIAS_EAST,
    P_BIAS_NORTH,
    P_EAST,
    P_EAST_NORTH,
    P_NORTH,
    RISE_EAST,
    RISE_NORTH,
    SIDE_BIAS,
    SPEED,
    YAW_RATE,
)
from touchline.services.onboard.interface import TICK_S

Floats = NDArray[np.float64]

LEARN_TICKS: Final = 8
"""Between two samples of the slope; a divisor of the ring's length. Nearer ones say nothing new."""
_CURVE_SHARE = 0.05  # of the curve's acceleration that may be wrong: slip, and the tyres' settling
_CLIP = 3.0  # σ: a bump or a skid may not teach more than that
_MOVING_MPS = 0.2
_MEAN_SLIP_WALK = 4e-9  # per fix: about a minute is remembered


def start_learning(c: Floats, slow: Floats) -> None:
    """Reset what is learned to level ground and no slip, with the uncertainty of knowing nothing yet."""
    slow[:] = 0.0
    slow[P_BIAS] = c[C_SIDE_BIAS_VAR]
    slow[[P_EAST, P_NORTH]] = c[C_RISE_VAR]
    slow[MEAN_VAR : MEAN_VAR + 2] = c[C_MEAN_SLIP_VAR : C_MEAN_SLIP_VAR + 2]


@kernel
def store_learned(slow: Floats, z: Floats) -> None:
    """Store in a tick's inputs the learned figures that the tick is run with.

    Args:
        slow: (SLOW,) what is learned beside the states.
        z: (INPUTS,) of the tick, updated.
    """
    z[IN_RISE_EAST], z[IN_RISE_NORTH] = slow[RISE_EAST], slow[RISE_NORTH]
    z[IN_RISE_VAR] = slow[P_EAST] + slow[P_NORTH]
    z[IN_ERROR_MEAN], z[IN_ERROR_MEAN + 1] = slow[ERROR_MEAN], slow[ERROR_MEAN + 1]


@kernel
def learn(slot: int, x: Floats, z: Floats, fix: Floats, c: Floats, slow: Floats) -> None:
    """Learn from the oldest tick of the ring, which no late message changes any more.

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
    if slot % LEARN_TICKS == 0 and not math.isnan(z[IN_SIDE]):
        _learn_slope(x, z, c, slow)
    if fix[FIX_USED] > 0.0 and abs(x[SPEED]) > _MOVING_MPS:
        for i in range(2):
            slow[MEAN_VAR + i] += _MEAN_SLIP_WALK
            gain = slow[MEAN_VAR + i] / (slow[MEAN_VAR + i] + c[C_R_MEAN_SLIP + i])
            most = _CLIP * math.sqrt(c[C_R_MEAN_SLIP + i])
            slow[ERROR_MEAN + i] += gain * min(max(x[ODOMETRY_ERROR + i] - slow[ERROR_MEAN + i], -most), most)
            slow[MEAN_VAR + i] *= 1.0 - gain


@kernel
def _learn_slope(x: Floats, z: Floats, c: Floats, slow: Floats) -> None:
    """Kalman update of (bias, rise east, rise north) by what the left axis feels beyond the curve."""
    slow[P_BIAS] += c[C_Q_SIDE_BIAS] * LEARN_TICKS
    grown = c[C_Q_RISE] * abs(x[SPEED]) * TICK_S * LEARN_TICKS
    slow[P_EAST] += grown
    slow[P_NORTH] += grown
    curve = x[SPEED] * x[YAW_RATE]
    east, north = -math.sin(x[HEADING]), math.cos(x[HEADING])  # of the row; that of the bias is 1
    g0 = slow[P_BIAS] + east * slow[P_BIAS_EAST] + north * slow[P_BIAS_NORTH]
    g1 = slow[P_BIAS_EAST] + east * slow[P_EAST] + north * slow[P_EAST_NORTH]
    g2 = slow[P_BIAS_NORTH] + east * slow[P_EAST_NORTH] + north * slow[P_NORTH]
    s = g0 + east * g1 + north * g2 + c[C_R_SIDE] + (_CURVE_SHARE * curve) ** 2
    innovation = z[IN_SIDE] - curve - slow[SIDE_BIAS] - east * slow[RISE_EAST] - north * slow[RISE_NORTH]
    if z[IN_STILL] > 0.0 and contradicts(innovation, s):
        return
    most = _CLIP * math.sqrt(s)
    innovation = min(max(innovation, -most), most)
    slow[SIDE_BIAS] += g0 * innovation / s
    slow[RISE_EAST] += g1 * innovation / s
    slow[RISE_NORTH] += g2 * innovation / s
    slow[P_BIAS] -= g0 * g0 / s
    slow[P_BIAS_EAST] -= g0 * g1 / s
    slow[P_BIAS_NORTH] -= g0 * g2 / s
    slow[P_EAST] -= g1 * g1 / s
    slow[P_EAST_NORTH] -= g1 * g2 / s
    slow[P_NORTH] -= g2 * g2 / s
