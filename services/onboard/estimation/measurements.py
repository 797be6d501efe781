"""The filter's measurements: rows, gates and updates of gyro, encoders, magnetometer and fixes.

Updates are sequential and scalar: P ← P − (PHᵀ)(PHᵀ)ᵀ/S keeps P symmetric to the bit. Where a sensor measures two
numbers at once its gate is one χ² test with two degrees of freedom on both.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.angles import wrapped
from touchline.services.core.jit import kernel
from touchline.services.onboard.drives import onboard_drive
from touchline.services.onboard.estimation.tail import weighed_variance
from touchline.services.onboard.estimation.updates import apply, apply_two, nis_of_two
from touchline.services.onboard.filter_model import (
    C_ANTENNA_X,
    C_ANTENNA_Y,
    C_MAST,
    C_R_GYRO,
    C_R_MAG,
    EAST,
    ENCODER_REJECTED_RECENT,
    FIX_AFTER,
    FIX_EAST,
    FIX_NORTH,
    FIX_VARIANCE,
    GATE_1_DOF,
    GATE_2_DOF,
    GNSS_EAST,
    GNSS_NORTH,
    GYRO_BIAS,
    HEADING,
    IN_ACCEL,
    IN_GYRO,
    IN_MAG,
    IN_ODOMETRY,
    IN_REFUSED,
    IN_RISE_EAST,
    IN_RISE_NORTH,
    IN_ROUGH,
    IN_SPAN,
    IN_STILL,
    MAG_BIAS,
    N_ENCODER,
    N_ENCODER_REJECTED,
    N_ENCODER_REJECTED_RUN,
    N_GYRO_REJECTED,
    N_MAG,
    N_MAG_REJECTED,
    NIS_ENCODER_SUM,
    NIS_MAG_SUM,
    NORTH,
    SPEED,
    STATES,
    YAW_RATE,
)
from touchline.services.onboard.interface import TICK_S

Floats = NDArray[np.float64]
Scratch = tuple[Floats, Floats]
"""Room for the rows of a measurement (2, STATES), and for P hᵀ of one of them (STATES,)."""

_STILL_SPEED_VAR = 1e-6  # (1 mm/s)²
_STILL_YAW_VAR = 4e-8  # (0.2 mrad/s)²
_SLIP_RECENT = 1.0 / 30.0  # weight of the newest tick in the slip test
_SPAN_ACCEL_MPS2 = 1.0
_ENCODER_REJECTED_RUN_LIMIT = 50.0
_ROUGH_SHARE = 1.0 / 30.0  # of the newest tick
_ROUGH_MOST = 1.0  # (m/s²)² a tick counts: one jolt is no shaking
_ROUGH_FROM = 0.3**2  # (m/s²)²; noise by the data sheet makes 0.012², driving a plan at most 0.17², an e-stop 0.31²
_PATIENCE = 100.0  # factor on the encoders' variance once they have been rejected for half a second


class TickEstimate(NamedTuple):
    """What the filter's ring holds of a tick.

    Attributes:
        x: (STATES,) its state.
        P: (STATES, STATES) the state's covariance.
        z: (INPUTS,) its inputs.
    """

    x: Floats
    P: Floats
    z: Floats


@kernel
def add_shaking_noise(P: Floats, before: Floats, z: Floats) -> None:
    """Add process noise to the speed while the accelerometer shakes.

    A mount that has come loose shakes by far more than the data sheet has it. Believed, it carries the speed away from
    the wheels, and these are rejected for it; the position then is off by many times its σ and contradicts the fixes
    for good. Noise of σ a sample steps by σ/√2 in the mean of two and adds σ·10 ms to the speed. One jolt, as of a
    wheel that begins to slip, is no shaking: there the accelerometer is right.

    Args:
        P: (STATES, STATES) predicted covariance, updated.
        before: (INPUTS,) of the tick before.
        z: (INPUTS,) of this tick; its IN_ROUGH is filled in.
    """
    z[IN_ROUGH] = before[IN_ROUGH] if before[IN_ROUGH] > 0.0 else 0.0
    step = z[IN_ACCEL] - before[IN_ACCEL]
    if not math.isnan(step):
        z[IN_ROUGH] += _ROUGH_SHARE * (min(step * step, _ROUGH_MOST) - z[IN_ROUGH])
    if z[IN_ROUGH] > _ROUGH_FROM:
        P[SPEED, SPEED] += 2.0 * z[IN_ROUGH] * TICK_S * TICK_S


@kernel
def _odometry(at: TickEstimate, drive: Any, n: Floats, live: bool, scratch: Scratch) -> None:
    """Update with the drive's odometry, behind one gate for both of its numbers."""
    x, P, z = at
    h, g = scratch
    for k in range(STATES):
        h[0, k], h[1, k] = 0.0, 0.0
    y0, y1, r = onboard_drive.odometry(drive, x, z, h)
    uneven = 0.5 * (z[IN_SPAN] - 1.0) * TICK_S * _SPAN_ACCEL_MPS2  # the mean of several ticks is not the last one
    r += uneven * uneven
    y = y0, y1
    nis = nis_of_two(P, h, y, r)
    z[IN_REFUSED] = z[IN_REFUSED] + 1.0 if nis > GATE_2_DOF else 0.0
    if live:
        n[N_ENCODER] += 1.0
        n[NIS_ENCODER_SUM] += nis
        n[ENCODER_REJECTED_RECENT] += _SLIP_RECENT * ((1.0 if nis > GATE_2_DOF else 0.0) - n[ENCODER_REJECTED_RECENT])
        if nis > GATE_2_DOF:
            n[N_ENCODER_REJECTED] += 1.0
            n[N_ENCODER_REJECTED_RUN] += 1.0
        else:
            n[N_ENCODER_REJECTED_RUN] = 0.0
    if nis > GATE_2_DOF:
        if n[N_ENCODER_REJECTED_RUN] < _ENCODER_REJECTED_RUN_LIMIT:
            return
        r *= _PATIENCE
    apply_two(x, P, h, y, r, g)


@kernel
def _disputed(at: TickEstimate, c: Floats, n: Floats, live: bool) -> bool:
    """Whether the gyro says that the standing robot turns: it is broken, or somebody turns the robot.

    Neither can be ruled out, so the reading is not used, and the heading becomes as uncertain as that turn is large.
    """
    x, P, z = at
    if z[IN_STILL] == 0.0:
        return False
    turn = z[IN_GYRO] - x[GYRO_BIAS]
    if turn * turn <= GATE_1_DOF * (P[GYRO_BIAS, GYRO_BIAS] + c[C_R_GYRO] + _STILL_YAW_VAR):
        return False
    if live:
        n[N_GYRO_REJECTED] += 1.0
    sigma = math.sqrt(P[HEADING, HEADING]) + abs(turn) * TICK_S
    P[HEADING, HEADING] = sigma * sigma
    return True


@kernel
def measure(at: TickEstimate, c: Floats, drive: Any, n: Floats, live: bool, scratch: Scratch) -> None:
    """Update a tick's prediction with all of its measurements but GNSS.

    Args:
        at: The tick; state and covariance are the predicted ones, and are updated.
        c: (FIGURES,) constants.
        drive: Figures of the drive.
        n: (COUNTERS,) updated if the tick is live.
        live: Whether its measurements are new.
        scratch: Overwritten.
    """
    x, P, z = at
    h, g = scratch
    row = h[0]
    for k in range(STATES):
        row[k] = 0.0
    if not math.isnan(z[IN_GYRO]) and not _disputed(at, c, n, live):
        row[YAW_RATE], row[GYRO_BIAS] = 1.0, 1.0
        apply(x, P, row, z[IN_GYRO] - x[YAW_RATE] - x[GYRO_BIAS], c[C_R_GYRO], g)
    if z[IN_STILL] > 0.0:
        z[IN_REFUSED] = 0.0
        for k in range(STATES):
            row[k] = 0.0
        row[SPEED] = 1.0
        apply(x, P, row, -x[SPEED], _STILL_SPEED_VAR, g)
        row[SPEED], row[YAW_RATE] = 0.0, 1.0
        apply(x, P, row, -x[YAW_RATE], _STILL_YAW_VAR, g)
        if live:
            n[ENCODER_REJECTED_RECENT] -= _SLIP_RECENT * n[ENCODER_REJECTED_RECENT]
    elif not math.isnan(z[IN_ODOMETRY]):
        _odometry(at, drive, n, live, scratch)
    if not math.isnan(z[IN_MAG]):
        for k in range(STATES):
            row[k] = 0.0
        row[HEADING], row[MAG_BIAS] = 1.0, 1.0
        y = wrapped(z[IN_MAG] - x[HEADING] - x[MAG_BIAS])
        s = P[HEADING, HEADING] + 2.0 * P[HEADING, MAG_BIAS] + P[MAG_BIAS, MAG_BIAS] + c[C_R_MAG]
        nis = y * y / s
        if live:
            n[N_MAG] += 1.0
            n[NIS_MAG_SUM] += nis
            if nis > GATE_1_DOF:
                n[N_MAG_REJECTED] += 1.0
        if nis <= GATE_1_DOF:
            apply(x, P, row, y, c[C_R_MAG], g)


@kernel
def fix_rows(at: TickEstimate, fix: Floats, c: Floats, h: Floats) -> tuple[float, float]:
    """Innovations and Jacobian of a fix: of the antenna, whose mast leans with the ground, some time after the tick.

    Args:
        at: The tick in which the fix is valid.
        fix: (FIXES,) it.
        c: (FIGURES,) constants.
        h: (2, STATES) filled with the Jacobian of east and north.

    Returns:
        Innovations east and north [m].
    """
    x, _, z = at
    after = fix[FIX_AFTER]
    heading = x[HEADING] + x[YAW_RATE] * after
    cos, sin = math.cos(heading), math.sin(heading)
    arm_e = c[C_ANTENNA_X] * cos - c[C_ANTENNA_Y] * sin
    arm_n = c[C_ANTENNA_X] * sin + c[C_ANTENNA_Y] * cos
    ahead = x[SPEED] * after
    for k in range(STATES):
        h[0, k], h[1, k] = 0.0, 0.0
    h[0, EAST], h[0, GNSS_EAST] = 1.0, 1.0
    h[1, NORTH], h[1, GNSS_NORTH] = 1.0, 1.0
    h[0, HEADING], h[1, HEADING] = -arm_n - ahead * sin, arm_e + ahead * cos
    h[0, SPEED], h[1, SPEED] = after * cos, after * sin
    h[0, YAW_RATE], h[1, YAW_RATE] = -arm_n * after, arm_e * after
    return (
        fix[FIX_EAST] - (x[EAST] + ahead * cos + arm_e - c[C_MAST] * z[IN_RISE_EAST] + x[GNSS_EAST]),
        fix[FIX_NORTH] - (x[NORTH] + ahead * sin + arm_n - c[C_MAST] * z[IN_RISE_NORTH] + x[GNSS_NORTH]),
    )


@kernel
def use_fix(at: TickEstimate, fix: Floats, c: Floats, scratch: Scratch) -> None:
    """Update the tick in which a fix is valid, with the variance by which the fix is weighed (`weighed_variance`).

    Args:
        at: That tick; state and covariance are updated.
        fix: (FIXES,) it.
        c: (FIGURES,) constants.
        scratch: Overwritten.
    """
    x, P, _ = at
    h, g = scratch
    y = fix_rows(at, fix, c, h)
    apply_two(x, P, h, y, weighed_variance(P, h, y, fix[FIX_VARIANCE]), g)
