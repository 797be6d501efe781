"""The filter's measurements: rows, gates and updates of gyro, encoders, magnetometer and fixes.

Updates are sequential and scalar: P ← P − (PHᵀ)(PHᵀ)ᵀ/S keeps P symmetric to the bit. Where a sensor measures two
numbers at once its gate is one χ² test with two degrees of freedom on both.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.jit import kernel
from touchline.services.onboard.estimation.tail import weighed_variance
from touchline.services.onboard.estimation.updates import apply, apply_two, two, wrap
from touchline.services.onboard.filter_model import (
    C_ANTENNA_X,
    C_ANTENNA_Y,
    C_MAST,
    C_R_ENCODER,
    C_R_ENCODER_TURN,
    C_R_GYRO,
    C_R_MAG,
    C_TRACK,
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
    IN_LEFT,
    IN_LEFT_SMOOTH,
    IN_MAG,
    IN_REFUSED,
    IN_RIGHT,
    IN_RIGHT_SMOOTH,
    IN_RISE_EAST,
    IN_RISE_NORTH,
    IN_ROUGH,
    IN_SPAN,
    IN_STILL,
    LEFT_SLIP,
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
    RIGHT_SLIP,
    SPEED,
    STATES,
    YAW_RATE,
)
from touchline.services.onboard.interface import TICK_S

Floats = NDArray[np.float64]

_STILL_SPEED_VAR = 1e-6  # (1 mm/s)²
_STILL_YAW_VAR = 4e-8  # (0.2 mrad/s)²
_SLIP_RECENT = 1.0 / 30.0  # weight of the newest tick in the slip test
_SPAN_ACCEL_MPS2 = 1.0
_SMOOTHING = 1.0 / 30.0  # per tick
_SUDDEN_SHARE = 0.1
_SUDDEN_MPS = 0.02
_ENCODER_REJECTED_RUN_LIMIT = 50.0
_SLIP_PER_MPS = 0.4  # 1 σ, of a wheel's change of speed in a tick
_JUMP_TICKS = 10
_JUMP_VAR = 0.05**2
_JUMP_FROM_MPS = 0.6  # slip is a share: it explains little of a slow wheel's error
_ROUGH_SHARE = 1.0 / 30.0  # of the newest tick
_ROUGH_MOST = 1.0  # (m/s²)² a tick counts: one jolt is no shaking
_ROUGH_FROM = 0.3**2  # (m/s²)²; noise by the data sheet makes 0.012², driving a plan at most 0.17², an e-stop 0.31²
_PATIENCE = 100.0  # factor on the encoders' variance once they have been rejected for half a second


@kernel
def smooth_rims(before: Floats, z: Floats) -> None:
    """The rim speeds that slip is a share of, from the inputs (INPUTS,) of the tick before and of this one.

    Taken from the tick's own reading or from the state they would share its noise, and the gain with the innovation:
    noise would become a bias of the slip. So they are smooth, but keep up with a wheel that changes its speed.
    """
    for wheel in range(2):
        smooth, last, rim = before[IN_LEFT_SMOOTH + wheel], before[IN_LEFT + wheel], z[IN_LEFT + wheel]
        if not math.isnan(last):
            smooth += _SMOOTHING * (last - smooth)
        if abs(rim - smooth) > _SUDDEN_SHARE * abs(rim) + _SUDDEN_MPS:
            smooth = rim
        z[IN_LEFT_SMOOTH + wheel] = smooth


@kernel
def strain_tyres(P: Floats, before: Floats, z: Floats) -> None:
    """Let the slips be as uncertain as wheels that change their speed make them; inputs as of `smooth_rims`.

    A tyre pushes by slipping: on grass by 1 % and on wet grass by 2 % per m/s², and by far more at the end of its grip,
    which the robot does not know. That comes and goes as fast as the wheel is sped up. Readings that are rejected again
    and again are a slip that jumped: taken for outliers they would be rejected until the slip is forgotten. Without
    the accelerometer nothing but the wheels tells the speed, and their slip cannot be told.
    """
    z[IN_REFUSED] = before[IN_REFUSED] if before[IN_REFUSED] > 0.0 else 0.0
    if math.isnan(z[IN_ACCEL]):
        return
    for wheel in range(2):
        i = LEFT_SLIP + wheel
        change = z[IN_LEFT + wheel] - before[IN_LEFT + wheel]
        if not math.isnan(change):
            P[i, i] += (_SLIP_PER_MPS * change) ** 2
        if z[IN_REFUSED] >= _JUMP_TICKS and abs(z[IN_LEFT_SMOOTH + wheel]) > _JUMP_FROM_MPS:
            P[i, i] = max(P[i, i], _JUMP_VAR)


@kernel
def doubt_accelerometer(P: Floats, before: Floats, z: Floats) -> None:
    """Let the speed be as uncertain as an accelerometer that shakes makes it; inputs as of `smooth_rims`.

    A mount that has come loose shakes by far more than the data sheet has it. Believed, it carries the speed away from
    the wheels, and these are rejected for it; the position then is off by many times its σ and contradicts the fixes
    for good. Noise of σ a sample steps by σ/√2 in the mean of two and adds σ·10 ms to the speed. One jolt, as of a
    wheel that begins to slip, is no shaking: there the accelerometer is right.
    """
    z[IN_ROUGH] = before[IN_ROUGH] if before[IN_ROUGH] > 0.0 else 0.0
    step = z[IN_ACCEL] - before[IN_ACCEL]
    if not math.isnan(step):
        z[IN_ROUGH] += _ROUGH_SHARE * (min(step * step, _ROUGH_MOST) - z[IN_ROUGH])
    if z[IN_ROUGH] > _ROUGH_FROM:
        P[SPEED, SPEED] += 2.0 * z[IN_ROUGH] * TICK_S * TICK_S


@kernel
def _encoders(x: Floats, P: Floats, z: Floats, c: Floats, n: Floats, live: bool, h: Floats, g: Floats) -> None:
    """Rim speeds: ground speed of a wheel is its nominal rim speed less slip."""
    half = 0.5 * c[C_TRACK]
    left, right = z[IN_LEFT], z[IN_RIGHT]
    for k in range(STATES):
        h[0, k], h[1, k] = 0.0, 0.0
    over_left, over_right = x[SPEED] - half * x[YAW_RATE], x[SPEED] + half * x[YAW_RATE]
    h[0, SPEED], h[0, YAW_RATE], h[0, LEFT_SLIP] = 1.0, -half, z[IN_LEFT_SMOOTH]
    h[1, SPEED], h[1, YAW_RATE], h[1, RIGHT_SLIP] = 1.0, half, z[IN_RIGHT_SMOOTH]
    y0 = left - z[IN_LEFT_SMOOTH] * x[LEFT_SLIP] - over_left
    y1 = right - z[IN_RIGHT_SMOOTH] * x[RIGHT_SLIP] - over_right
    uneven = 0.5 * (z[IN_SPAN] - 1.0) * 0.01 * _SPAN_ACCEL_MPS2  # the mean of several ticks is not the last one
    r = c[C_R_ENCODER] + (c[C_R_ENCODER_TURN] * half * x[YAW_RATE]) ** 2 + uneven * uneven
    nis = two(P, h, y0, y1, r)
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
    apply_two(x, P, h, y0, y1, r, g)


@kernel
def _disputed(x: Floats, P: Floats, z: Floats, c: Floats, n: Floats, live: bool) -> bool:
    """Whether the gyro says that the standing robot turns: it is broken, or somebody turns the robot.

    Neither can be ruled out, so the reading is not used, and the heading becomes as uncertain as that turn is large.
    """
    if z[IN_STILL] == 0.0:
        return False
    turn = z[IN_GYRO] - x[GYRO_BIAS]
    if turn * turn <= GATE_1_DOF * (P[GYRO_BIAS, GYRO_BIAS] + c[C_R_GYRO] + _STILL_YAW_VAR):
        return False
    if live:
        n[N_GYRO_REJECTED] += 1.0
    sigma = math.sqrt(P[HEADING, HEADING]) + abs(turn) * 0.01
    P[HEADING, HEADING] = sigma * sigma
    return True


@kernel
def measure(x: Floats, P: Floats, z: Floats, c: Floats, n: Floats, live: bool, h: Floats, g: Floats) -> None:
    """All of a tick's measurements but GNSS."""
    row = h[0]
    for k in range(STATES):
        row[k] = 0.0
    if not math.isnan(z[IN_GYRO]) and not _disputed(x, P, z, c, n, live):
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
    elif not math.isnan(z[IN_LEFT]):
        _encoders(x, P, z, c, n, live, h, g)
    if not math.isnan(z[IN_MAG]):
        for k in range(STATES):
            row[k] = 0.0
        row[HEADING], row[MAG_BIAS] = 1.0, 1.0
        y = wrap(z[IN_MAG] - x[HEADING] - x[MAG_BIAS])
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
def fix_rows(x: Floats, fix: Floats, z: Floats, c: Floats, h: Floats) -> tuple[float, float]:
    """Fill `h` (2, STATES) for a fix of the antenna, whose mast leans with the ground, and return the innovations."""
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
def use_fix(x: Floats, P: Floats, fix: Floats, z: Floats, c: Floats, h: Floats, g: Floats) -> None:
    """Take a fix (FIXES,) into the tick with inputs `z` (INPUTS,); `h` (2, STATES), `g` (STATES,) are scratch."""
    y0, y1 = fix_rows(x, fix, z, c, h)
    apply_two(x, P, h, y0, y1, weighed_variance(P, h, y0, y1, fix[FIX_VARIANCE]), g)
