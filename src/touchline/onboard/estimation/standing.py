"""Standstill: wheels that stand outweigh the accelerometer.

A robot that has come to rest is held by its brakes. When its accelerometer then reads an acceleration, something has
knocked or shaken the robot, or the sensor is wrong; the wheels would turn if the robot moved. If it were used, a jolt
of 10 m/s² for 50 ms would become a speed of half a metre per second.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import borrowing, kernel
from touchline.onboard.filter_model import ACCEL_BIAS, GATE_1_DOF, FilterFigures, TickInputs

Floats = NDArray[np.float64]

JOLT_MPS2: Final = 0.5
"""Reading beyond the expected one that is a jolt: that of a lean by 3°, and thirty times the noise by the data sheet. A
wheel that stands turns by less than 1e-4 rad in a tick: its acceleration is below 0.1 m/s²."""
LASTING_TICKS: Final = 500
"""Ticks after which it is no jolt: the robot has been tilted, or the bias has jumped, and is learned anew."""
_STEADY = 0.3**2  # (m/s²)², mean square step from tick to tick: more is shaking, which no bias explains


@kernel
def contradicts(mps2: float, variance: float) -> bool:
    """Return whether an axis of the accelerometer contradicts wheels that stand.

    Args:
        mps2: Reading beyond the one expected at rest [m/s²].
        variance: Variance of the expected one, without the sensor's own noise [(m/s²)²].
    """
    return mps2 * mps2 > JOLT_MPS2 * JOLT_MPS2 + GATE_1_DOF * variance


@borrowing
def settle_dispute(x: Floats, P: Floats, before: TickInputs, z: TickInputs, c: FilterFigures) -> bool:
    """Return whether the acceleration of a tick is not to be used because the wheels stand; count such ticks in a row.

    A constant contradiction that lasts is learned as a bias at once, by a larger variance of the bias: at standstill
    the speed is known, so neither it nor the position moves.

    Args:
        x: (STATES,) state of the tick before.
        P: (STATES, STATES) its covariance, updated.
        before: Inputs of the tick before.
        z: Inputs of this tick, updated.
        c: Figures of the filter.
    """
    so_far, z.disputed_ticks = before.disputed_ticks, 0
    if not z.still:
        return False
    if math.isnan(z.accel_mps2):
        z.disputed_ticks = so_far
        return False
    excess = z.accel_mps2 - x[ACCEL_BIAS]
    if not contradicts(excess, P[ACCEL_BIAS, ACCEL_BIAS] + c.r_side):
        return False
    if so_far >= LASTING_TICKS and not before.rough > _STEADY:
        P[ACCEL_BIAS, ACCEL_BIAS] = max(P[ACCEL_BIAS, ACCEL_BIAS], excess * excess)
        return False
    z.disputed_ticks = so_far + 1
    return True
