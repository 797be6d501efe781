"""The filter's arithmetic: one kernel call per tick, with late fixes put where they belong in time.

Updates are sequential and scalar: P ← P − (PHᵀ)(PHᵀ)ᵀ/S keeps P symmetric to the bit. Where a sensor measures two
numbers at once its gate is one χ² test with two degrees of freedom on both.

A fix is valid some 110 ms before it arrives. The ring holds the posterior of each of the last `RING` ticks and what
was measured in it; whatever comes late is entered in its own tick, and the ticks since are run again. Fixes and samples
that arrive out of order therefore end in the same estimate as in order.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from schemas.jit import kernel
from services.robot_sim.onboard.estimator.model import (
    ACCEL_BIAS,
    C_ANTENNA_X,
    C_ANTENNA_Y,
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
    FIX_USED,
    FIX_VARIANCE,
    GATE_1_DOF,
    GATE_2_DOF,
    GATE_FIX,
    GNSS_EAST,
    GNSS_NORTH,
    GYRO_BIAS,
    HEADING,
    IN_ACCEL,
    IN_GYRO,
    IN_LEFT,
    IN_MAG,
    IN_RIGHT,
    IN_SPAN,
    IN_STILL,
    INNOVATION_EAST,
    INNOVATION_NORTH,
    LEFT_SLIP,
    MAG_BIAS,
    N_ENCODER,
    N_ENCODER_REJECTED,
    N_ENCODER_REJECTED_RUN,
    N_FIX_DUPLICATE,
    N_FIX_LATE,
    N_FIX_OUT_OF_ORDER,
    N_FIX_REJECTED,
    N_FIX_REJECTED_RUN,
    N_FIXES,
    N_GYRO_REJECTED,
    N_MAG,
    N_MAG_REJECTED,
    NIS_ENCODER_SUM,
    NIS_FIX_LAST,
    NIS_FIX_RECENT,
    NIS_FIX_SUM,
    NIS_MAG_SUM,
    NORTH,
    RIGHT_SLIP,
    RING,
    SPEED,
    STATES,
    YAW_RATE,
)
from services.robot_sim.onboard.estimator.prediction import predict
from services.robot_sim.onboard.estimator.updates import apply, apply_two, two, wrap

Floats = NDArray[np.float64]

_STILL_SPEED_VAR = 1e-6  # (1 mm/s)²
_STILL_YAW_VAR = 4e-8  # (0.2 mrad/s)²
_RECENT = 0.1  # weight of the newest fix in the running NIS
_SLIP_RECENT = 1.0 / 30.0  # weight of the newest tick in the slip test
_NO_IMU_SPEED_VAR = 1e-4  # (1 m/s² · a tick)²
_SPAN_ACCEL_MPS2 = 1.0
_ENCODER_REJECTED_RUN_LIMIT = 50.0
_PATIENCE = 100.0  # factor on the encoders' variance once they have been rejected for half a second


@kernel
def _encoders(x: Floats, P: Floats, z: Floats, c: Floats, n: Floats, live: bool, h: Floats, g: Floats) -> None:
    """Rim speeds: ground speed of a wheel is its nominal rim speed less slip."""
    half = 0.5 * c[C_TRACK]
    left, right = z[IN_LEFT], z[IN_RIGHT]
    for k in range(STATES):
        h[0, k], h[1, k] = 0.0, 0.0
    over_left, over_right = x[SPEED] - half * x[YAW_RATE], x[SPEED] + half * x[YAW_RATE]
    # The rim speeds in the rows are the predicted ones: measured ones would share their noise with the innovations,
    # and slip be biased by it.
    h[0, SPEED], h[0, YAW_RATE], h[0, LEFT_SLIP] = 1.0, -half, over_left / (1.0 - x[LEFT_SLIP])
    h[1, SPEED], h[1, YAW_RATE], h[1, RIGHT_SLIP] = 1.0, half, over_right / (1.0 - x[RIGHT_SLIP])
    y0 = left * (1.0 - x[LEFT_SLIP]) - over_left
    y1 = right * (1.0 - x[RIGHT_SLIP]) - over_right
    uneven = 0.5 * (z[IN_SPAN] - 1.0) * 0.01 * _SPAN_ACCEL_MPS2  # the mean of several ticks is not the last one
    r = c[C_R_ENCODER] + (c[C_R_ENCODER_TURN] * half * x[YAW_RATE]) ** 2 + uneven * uneven
    nis = two(P, h, y0, y1, r, r)
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
    apply_two(x, P, h, y0, y1, r, r, g)


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
def _measure(x: Floats, P: Floats, z: Floats, c: Floats, n: Floats, live: bool, h: Floats, g: Floats) -> None:
    """All of a tick's measurements but GNSS."""
    row = h[0]
    for k in range(STATES):
        row[k] = 0.0
    if not math.isnan(z[IN_GYRO]) and not _disputed(x, P, z, c, n, live):
        row[YAW_RATE], row[GYRO_BIAS] = 1.0, 1.0
        apply(x, P, row, z[IN_GYRO] - x[YAW_RATE] - x[GYRO_BIAS], c[C_R_GYRO], g)
    if z[IN_STILL] > 0.0:
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
def _fix_rows(x: Floats, fix: Floats, c: Floats, h: Floats) -> tuple[float, float]:
    """Fill `h` (2, STATES) for a fix of the antenna and return the innovations."""
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
        fix[FIX_EAST] - (x[EAST] + ahead * cos + arm_e + x[GNSS_EAST]),
        fix[FIX_NORTH] - (x[NORTH] + ahead * sin + arm_n + x[GNSS_NORTH]),
    )


@kernel
def _use_fix(x: Floats, P: Floats, fix: Floats, c: Floats, h: Floats, g: Floats) -> None:
    y0, y1 = _fix_rows(x, fix, c, h)
    apply_two(x, P, h, y0, y1, fix[FIX_VARIANCE], fix[FIX_VARIANCE], g)


@kernel
def _step(
    xs: Floats, Ps: Floats, inputs: Floats, slot: int, c: Floats, n: Floats, live: bool, h: Floats, g: Floats
) -> None:
    """The posterior of `slot` from that of the slot before."""
    before = (slot - 1) % RING
    x, P = xs[slot], Ps[slot]
    for i in range(STATES):
        x[i] = xs[before, i]
        for k in range(STATES):
            P[i, k] = Ps[before, i, k]
    accel = inputs[slot, IN_ACCEL]
    if math.isnan(accel):
        accel = x[ACCEL_BIAS]
        P[SPEED, SPEED] += _NO_IMU_SPEED_VAR
    predict(x, P, accel, c)
    _measure(x, P, inputs[slot], c, n, live, h, g)


@kernel
def _rerun(
    xs: Floats,
    Ps: Floats,
    inputs: Floats,
    fixes: Floats,
    c: Floats,
    n: Floats,
    first: int,
    last: int,
    live: int,
    h: Floats,
    g: Floats,
) -> None:
    """Run the ticks `first` … `last` again; statistics count in tick `live` only."""
    for tick in range(first, last + 1):
        slot = tick % RING
        _step(xs, Ps, inputs, slot, c, n, tick == live, h, g)
        if fixes[slot, FIX_USED] > 0.0:
            _use_fix(xs[slot], Ps[slot], fixes[slot], c, h, g)


@kernel
def advance(
    xs: Floats,
    Ps: Floats,
    inputs: Floats,
    fixes: Floats,
    c: Floats,
    n: Floats,
    tick: int,
    oldest: int,
    live: int,
) -> None:
    """Advance the filter by one tick, from the `oldest` tick on that learned something new.

    Args:
        xs: (RING, STATES) posterior states by tick modulo RING; `inputs[tick % RING]` is already filled.
        Ps: (RING, STATES, STATES) their covariances.
        inputs: (RING, INPUTS) measurements of each tick but GNSS.
        fixes: (RING + 1, FIXES) fixes by the tick they are valid in; the last row holds the one that just arrived.
        c: (FIGURES,) constants.
        n: (COUNTERS,) counters and innovations, updated.
        tick: This tick.
        oldest: At most `tick`, later than the tick in which the filter was started.
        live: The tick whose measurements are new and count in the statistics.
    """
    h = np.zeros((2, STATES))
    g = np.zeros(STATES)
    fixes[tick % RING, FIX_USED] = 0.0
    _rerun(xs, Ps, inputs, fixes, c, n, oldest, tick, live, h, g)


@kernel
def take_fix(
    xs: Floats,
    Ps: Floats,
    inputs: Floats,
    fixes: Floats,
    c: Floats,
    n: Floats,
    tick: int,
    first_tick: int,
    fix_tick: int,
) -> None:
    """Take in a fix, `fixes[RING]`, that has arrived in `tick` and is valid in `fix_tick`; the rest as `advance`.

    Fixes from before `first_tick`, in which the filter was started, are taken as of then.
    """
    h = np.zeros((2, STATES))
    g = np.zeros(STATES)
    at = max(fix_tick, first_tick)
    if at > tick or tick - at > RING - 2:
        n[N_FIX_LATE] += 1.0
        return
    where = at % RING
    fix = fixes[RING]
    if fixes[where, FIX_USED] > 0.0 and at == fix_tick:
        n[N_FIX_DUPLICATE] += 1.0
        return
    y0, y1 = _fix_rows(xs[where], fix, c, h)
    nis = two(Ps[where], h, y0, y1, fix[FIX_VARIANCE], fix[FIX_VARIANCE])
    n[INNOVATION_EAST], n[INNOVATION_NORTH], n[NIS_FIX_LAST] = y0, y1, nis
    if nis > GATE_FIX:
        n[N_FIX_REJECTED] += 1.0
        n[N_FIX_REJECTED_RUN] += 1.0
        return
    n[N_FIX_REJECTED_RUN] = 0.0
    n[N_FIXES] += 1.0
    n[NIS_FIX_SUM] += nis
    n[NIS_FIX_RECENT] += _RECENT * (nis - n[NIS_FIX_RECENT])
    for later in range(at + 1, tick + 1):
        if fixes[later % RING, FIX_USED] > 0.0:
            n[N_FIX_OUT_OF_ORDER] += 1.0
            break
    for k in range(fixes.shape[1]):
        fixes[where, k] = fix[k]
    fixes[where, FIX_USED] = 1.0
    _use_fix(xs[where], Ps[where], fixes[where], c, h, g)
    _rerun(xs, Ps, inputs, fixes, c, n, at + 1, tick, -1, h, g)
