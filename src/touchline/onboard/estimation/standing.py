"""Standstill: wheels that stand are believed over the accelerometer.

A robot that has come to rest is held by its brakes. When its accelerometer then says that it speeds up, something has
knocked or shaken the robot, or the sensor is wrong; the wheels would turn if the robot went anywhere. Believed, a jolt
of 10 m/s² for 50 ms is a speed of half a metre per second.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.onboard.filter_model import ACCEL_BIAS, GATE_1_DOF, FilterFigures, TickInputs

Floats = NDArray[np.float64]

JOLT_MPS2: Final = 0.5
"""The robot leaning by 3° feels as much, and its data sheet's noise is thirty times less. A wheel that stands turns by
less than 1e-4 rad in a tick: it speeds up by less than 0.1 m/s²."""
LASTING_TICKS: Final = 500
"""After so long it is no jolt: the robot has been tilted, or the bias has jumped, and is learned anew."""
_STEADY = 0.3**2  # (m/s²)², mean square step from tick to tick: more is shaking, which no bias explains


@kernel
def contradicts(mps2: float, variance: float) -> bool:
    """Whether an accelerometer's axis disagrees with wheels that stand.

    Args:
        mps2: What it feels beyond its expected reading at rest.
        variance: Of that expectation, without the sensor's own noise.
    """
    return mps2 * mps2 > JOLT_MPS2 * JOLT_MPS2 + GATE_1_DOF * variance


@kernel
def settle_dispute(x: Floats, P: Floats, before: TickInputs, z: TickInputs, c: FilterFigures) -> bool:
    """Whether to ignore a tick's acceleration because the wheels stand; such ticks in a row are counted.

    A constant contradiction that lasts is learned as a bias at once, by giving the bias that much room: at standstill
    the speed is known, so neither it nor the position moves.

    Args:
        x: (STATES,) of the tick before.
        P: (STATES, STATES) its covariance, updated.
        before: Of the tick before.
        z: Of this tick, updated.
        c: Constants.
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
