"""The slip of a driven wheel as an error of odometry: ground speed = rim speed·(1 − s), whatever the drive."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.onboard.filter_model import ODOMETRY_ERROR, TickInputs

Floats = NDArray[np.float64]

STILL_RAD: Final = 1e-4
"""Wheel angle in a tick below which the wheel counts as standing."""
ENCODER_FLOOR_MPS: Final = 0.002
SLIP_LIMIT: Final = 0.05
"""Largest slip that the feed-forward compensates; random slip is below it. A tyre at the end of its grip slips more,
and faster wheels would only make it slip more still."""
JUMP_TICKS: Final = 10
_SMOOTHING = 1.0 / 30.0  # per tick
_SUDDEN_SHARE = 0.1
_SUDDEN_MPS = 0.02
_SLIP_PER_MPS = 0.4  # 1 σ, of a wheel's change of speed in a tick
_JUMP_VAR = 0.05**2
_JUMP_FROM_MPS = 0.6  # slip is a share: it explains little of a slow wheel's error


@kernel
def smooth_rim(wheel: int, before: TickInputs, z: TickInputs) -> None:
    """Smooth the rim speed that a wheel's slip is a share of.

    The tick's own reading, or the state, would share its noise with the gain and the innovation, and noise would become
    a bias of the slip. The smoothed speed does not, but keeps up with a wheel that changes its speed.

    Args:
        wheel: Index of its rim speed [m/s] in the odometry.
        before: Inputs of the tick before.
        z: Inputs of this tick; the wheel's smooth speed is filled in.
    """
    value, last, rim = before.smooth[wheel], before.odometry[wheel], z.odometry[wheel]
    if not math.isnan(last):
        value += _SMOOTHING * (last - value)
    if abs(rim - value) > _SUDDEN_SHARE * abs(rim) + _SUDDEN_MPS:
        value = rim
    z.smooth[wheel] = value


@kernel
def strain_slip(wheel: int, P: Floats, before: TickInputs, z: TickInputs) -> None:
    """Increase the variance of a wheel's slip by its change of speed.

    A tyre pushes by slipping: on grass by 1 % and on wet grass by 2 % per m/s², and by far more at the end of its grip,
    which the robot does not know. That slip comes and goes as fast as the wheel accelerates. Readings that are rejected
    again and again indicate a slip that jumped: treated as outliers they would be rejected until the slip is forgotten.

    Args:
        wheel: Index of its slip in the errors of odometry.
        P: (STATES, STATES) predicted covariance; the variance of that slip is updated.
        before: Inputs of the tick before.
        z: Inputs of this tick, with its smooth speeds.
    """
    i = ODOMETRY_ERROR + wheel
    change = z.odometry[wheel] - before.odometry[wheel]
    if not math.isnan(change):
        P[i, i] += (_SLIP_PER_MPS * change) ** 2
    if z.refused_ticks >= JUMP_TICKS and abs(z.smooth[wheel]) > _JUMP_FROM_MPS:
        P[i, i] = max(P[i, i], _JUMP_VAR)
