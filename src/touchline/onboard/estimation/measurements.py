"""The filter's measurements: rows, gates and updates of gyro, encoders, magnetometer and fixes.

Updates are sequential and scalar: P ← P − (PHᵀ)(PHᵀ)ᵀ/S keeps P symmetric to the bit. Where a sensor measures two
numbers at once its gate is one χ² test with two degrees of freedom on both.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.angles import wrapped
from touchline.core.jit import kernel
from touchline.onboard.drives import onboard_drive
from touchline.onboard.estimation.tail import weighed_variance
from touchline.onboard.estimation.updates import apply, apply_two, nis_of_two
from touchline.onboard.filter_model import (
    EAST,
    GATE_1_DOF,
    GATE_2_DOF,
    GNSS_EAST,
    GNSS_NORTH,
    GYRO_BIAS,
    HEADING,
    MAG_BIAS,
    NORTH,
    SPEED,
    STATES,
    YAW_RATE,
    FilterCounters,
    FilterFigures,
    FixInTick,
    TickInputs,
)
from touchline.onboard.interface import TICK_S

Floats = NDArray[np.float64]
Scratch = tuple[Floats, Floats]
"""Room for the rows of a measurement (2, STATES), and for P hᵀ of one of them (STATES,)."""

_STILL_SPEED_VAR = 1e-6  # (1 mm/s)²
_STILL_YAW_VAR = 4e-8  # (0.2 mrad/s)²
_SLIP_RECENT = 1.0 / 30.0  # weight of the newest tick in the slip test
_LEAN_SHARE = 1.0 / 50.0  # of the newest tick
_SPAN_ACCEL_MPS2 = 1.0
_ENCODER_REJECTED_RUN_LIMIT = 50
_ROUGH_SHARE = 1.0 / 30.0  # of the newest tick
_ROUGH_MOST = 1.0  # (m/s²)² a tick counts: one jolt is no shaking
_ROUGH_FROM = 0.3**2  # (m/s²)²; noise by the data sheet makes 0.012², driving a plan at most 0.17², an e-stop 0.31²
_PATIENCE = 100.0  # factor on the encoders' variance once they have been rejected for half a second


class TickEstimate(NamedTuple):
    """What the filter's ring holds of a tick.

    Attributes:
        x: (STATES,) its state.
        P: (STATES, STATES) the state's covariance.
        z: Its inputs.
    """

    x: Floats
    P: Floats
    z: TickInputs


@kernel
def add_shaking_noise(P: Floats, before: TickInputs, z: TickInputs) -> None:
    """Add process noise to the speed while the accelerometer shakes.

    A mount that has come loose shakes by far more than the data sheet has it. Believed, it carries the speed away from
    the wheels, and these are rejected for it; the position then is off by many times its σ and contradicts the fixes
    for good. Noise of σ a sample steps by σ/√2 in the mean of two and adds σ·10 ms to the speed. One jolt, as of a
    wheel that begins to slip, is no shaking: there the accelerometer is right.

    Args:
        P: (STATES, STATES) predicted covariance, updated.
        before: Of the tick before.
        z: Of this tick; how `rough` it is is filled in.
    """
    z.rough = before.rough
    step = z.accel_mps2 - before.accel_mps2
    if not math.isnan(step):
        z.rough += _ROUGH_SHARE * (min(step * step, _ROUGH_MOST) - z.rough)
    if z.rough > _ROUGH_FROM:
        P[SPEED, SPEED] += 2.0 * z.rough * TICK_S * TICK_S


@kernel
def _odometry(at: TickEstimate, drive: Any, n: FilterCounters, live: bool, scratch: Scratch) -> None:
    """Update with the drive's odometry, behind one gate for both of its numbers."""
    x, P, z = at
    h, g = scratch
    for k in range(STATES):
        h[0, k], h[1, k] = 0.0, 0.0
    y0, y1, r = onboard_drive.odometry(drive, x, z, h)
    uneven = 0.5 * (z.span_ticks - 1.0) * TICK_S * _SPAN_ACCEL_MPS2  # the mean of several ticks is not the last one
    r += uneven * uneven
    y = y0, y1
    nis = nis_of_two(P, h, y, r)
    z.refused_ticks = z.refused_ticks + 1 if nis > GATE_2_DOF else 0
    sigma = math.sqrt(r)
    for k in range(2):
        z.lean[k] += _LEAN_SHARE * (y[k] / sigma - z.lean[k])
    if live:
        n.encoders += 1
        n.encoder_nis_sum += nis
        n.encoders_rejected_recent += _SLIP_RECENT * ((1.0 if nis > GATE_2_DOF else 0.0) - n.encoders_rejected_recent)
        if nis > GATE_2_DOF:
            n.encoders_rejected += 1
            n.encoders_rejected_run += 1
        else:
            n.encoders_rejected_run = 0
    if nis > GATE_2_DOF:
        if n.encoders_rejected_run < _ENCODER_REJECTED_RUN_LIMIT:
            return
        r *= _PATIENCE
    apply_two(x, P, h, y, r, g)


@kernel
def _disputed(at: TickEstimate, c: FilterFigures, n: FilterCounters, live: bool) -> bool:
    """Whether the gyro says that the standing robot turns: it is broken, or somebody turns the robot.

    Neither can be ruled out, so the reading is not used, and the heading becomes as uncertain as that turn is large.
    """
    x, P, z = at
    if not z.still:
        return False
    turn = z.gyro_radps - x[GYRO_BIAS]
    if turn * turn <= GATE_1_DOF * (P[GYRO_BIAS, GYRO_BIAS] + c.r_gyro + _STILL_YAW_VAR):
        return False
    if live:
        n.gyro_rejected += 1
    sigma = math.sqrt(P[HEADING, HEADING]) + abs(turn) * TICK_S
    P[HEADING, HEADING] = sigma * sigma
    return True


@kernel
def measure(at: TickEstimate, c: FilterFigures, drive: Any, n: FilterCounters, live: bool, scratch: Scratch) -> None:
    """Update a tick's prediction with all of its measurements but GNSS.

    Args:
        at: The tick; state and covariance are the predicted ones, and are updated.
        c: Constants.
        drive: Figures of the drive.
        n: Updated if the tick is live.
        live: Whether its measurements are new.
        scratch: Overwritten.
    """
    x, P, z = at
    h, g = scratch
    row = h[0]
    for k in range(STATES):
        row[k] = 0.0
    if not math.isnan(z.gyro_radps) and not _disputed(at, c, n, live):
        row[YAW_RATE], row[GYRO_BIAS] = 1.0, 1.0
        apply(x, P, row, z.gyro_radps - x[YAW_RATE] - x[GYRO_BIAS], c.r_gyro, g)
    if z.still:
        z.refused_ticks = 0
        for k in range(STATES):
            row[k] = 0.0
        row[SPEED] = 1.0
        apply(x, P, row, -x[SPEED], _STILL_SPEED_VAR, g)
        row[SPEED], row[YAW_RATE] = 0.0, 1.0
        apply(x, P, row, -x[YAW_RATE], _STILL_YAW_VAR, g)
        if live:
            n.encoders_rejected_recent -= _SLIP_RECENT * n.encoders_rejected_recent
    elif not math.isnan(z.odometry[0]):
        _odometry(at, drive, n, live, scratch)
    if not math.isnan(z.mag_rad):
        for k in range(STATES):
            row[k] = 0.0
        row[HEADING], row[MAG_BIAS] = 1.0, 1.0
        y = wrapped(z.mag_rad - x[HEADING] - x[MAG_BIAS])
        s = P[HEADING, HEADING] + 2.0 * P[HEADING, MAG_BIAS] + P[MAG_BIAS, MAG_BIAS] + c.r_mag
        nis = y * y / s
        if live:
            n.mags += 1
            n.mag_nis_sum += nis
            if nis > GATE_1_DOF:
                n.mags_rejected += 1
        if nis <= GATE_1_DOF:
            apply(x, P, row, y, c.r_mag, g)


@kernel
def fix_rows(at: TickEstimate, fix: FixInTick, c: FilterFigures, h: Floats) -> tuple[float, float]:
    """Innovations and Jacobian of a fix: of the antenna, whose mast leans with the ground, some time after the tick.

    Args:
        at: The tick in which the fix is valid.
        fix: It.
        c: Constants.
        h: (2, STATES) filled with the Jacobian of east and north.

    Returns:
        Innovations east and north [m].
    """
    x, _, z = at
    after = fix.after_s
    heading = x[HEADING] + x[YAW_RATE] * after
    cos, sin = math.cos(heading), math.sin(heading)
    arm_e = c.antenna_x_m * cos - c.antenna_y_m * sin
    arm_n = c.antenna_x_m * sin + c.antenna_y_m * cos
    ahead = x[SPEED] * after
    for k in range(STATES):
        h[0, k], h[1, k] = 0.0, 0.0
    h[0, EAST], h[0, GNSS_EAST] = 1.0, 1.0
    h[1, NORTH], h[1, GNSS_NORTH] = 1.0, 1.0
    h[0, HEADING], h[1, HEADING] = -arm_n - ahead * sin, arm_e + ahead * cos
    h[0, SPEED], h[1, SPEED] = after * cos, after * sin
    h[0, YAW_RATE], h[1, YAW_RATE] = -arm_n * after, arm_e * after
    return (
        fix.east_m - (x[EAST] + ahead * cos + arm_e - c.mast_s2 * z.rise_east_mps2 + x[GNSS_EAST]),
        fix.north_m - (x[NORTH] + ahead * sin + arm_n - c.mast_s2 * z.rise_north_mps2 + x[GNSS_NORTH]),
    )


@kernel
def heading_row(at: TickEstimate, fix: FixInTick, row: Floats) -> tuple[float, float]:
    """Innovation and Jacobian of the heading of a camera's pose, some time after the tick.

    Args:
        at: The tick in which the pose is valid.
        fix: It, with a heading.
        row: (STATES,) filled with the Jacobian.

    Returns:
        The innovation [rad] and its variance [rad²].
    """
    x, P, _ = at
    after = fix.after_s
    for k in range(STATES):
        row[k] = 0.0
    row[HEADING], row[YAW_RATE] = 1.0, after
    known = P[HEADING, HEADING] + 2.0 * after * P[HEADING, YAW_RATE] + after * after * P[YAW_RATE, YAW_RATE]
    return wrapped(fix.heading_rad - x[HEADING] - x[YAW_RATE] * after), known + fix.heading_variance_rad2


@kernel
def use_fix(at: TickEstimate, fix: FixInTick, c: FilterFigures, scratch: Scratch) -> None:
    """Update the tick in which a fix is valid, with the variance by which the fix is weighed (`weighed_variance`).

    The heading of a camera's pose comes behind a gate of its own: a robot seen the wrong way round is at its place.

    Args:
        at: That tick; state and covariance are updated.
        fix: It.
        c: Constants.
        scratch: Overwritten.
    """
    x, P, _ = at
    h, g = scratch
    y = fix_rows(at, fix, c, h)
    weighed = weighed_variance(P, h, y, fix.variance_m2, c.fix_dof)
    apply_two(x, P, h, y, weighed, g)
    if math.isnan(fix.heading_rad):
        return
    turn, variance = heading_row(at, fix, h[0])
    if turn * turn <= GATE_1_DOF * variance:  # a wild position makes the heading no better than itself
        apply(x, P, h[0], turn, fix.heading_variance_rad2 * max(weighed / fix.variance_m2, 1.0), g)
