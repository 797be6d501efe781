"""Kernels of the filter's tick, and what is read of its state after one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.onboard import filter_model as m
from touchline.onboard.computer_state import Computer, FilterTimes, ReceivedFix
from touchline.onboard.estimation.aiding.gnss_aiding import FIX_FIXED, FIX_NONE, enter_fix
from touchline.onboard.estimation.claimed_covariance import claim
from touchline.onboard.estimation.delayed_fusion import advance, take_fix
from touchline.onboard.estimation.learned_constants import note_differences
from touchline.onboard.estimation.sample_buffer import take_samples
from touchline.onboard.estimation.standing import JOLT_MPS2
from touchline.onboard.interface import TICK_S, TICKS_PER_S

Floats = NDArray[np.float64]

_LEAD_S = 0.005  # by which a receiver's clock may be ahead and still be believed


@kernel
def take_frame(tick: int, fixes: Sequence[ReceivedFix], count: int, drive: Any, computer: Computer) -> None:
    """Process the measurements of a tick: samples, then the filter's step, then each fix.

    Args:
        tick: This tick; none is left out.
        fixes: (n,) fixes and poses that arrived in it, whenever they were measured.
        count: Number of them that are valid entries.
        drive: Figures of the drive.
        computer: (1,) state with the frame; sample buffer and filter are updated, the filter once it has been started.
    """
    c = computer[0]
    ring, times = c.filter, c.times
    oldest = take_samples(tick, drive, c)
    for i in range(count):
        _note_fix(tick, fixes[i], times)
    if times.first_tick < 0:
        return
    times.tick = tick
    _forget_innovation(ring.counters)
    advance(ring, drive, tick, max(oldest, times.first_tick + 1), c.buffer.encoder_tick)
    for i in range(count):
        fix = fixes[i]
        finite = math.isfinite(fix.stamp_s + fix.east_m + fix.north_m + fix.variance_m2)
        if fix.fix == FIX_NONE or not finite:
            continue
        used = take_fix(ring, drive, tick, times.first_tick, enter_fix(fix, ring))
        if used:
            note_differences(ring.states[tick % m.RING], ring.covariances[tick % m.RING], ring.counters)
        if used and fix.fix == FIX_FIXED:
            times.last_used_stamp_s = max(times.last_used_stamp_s, fix.stamp_s)


@kernel
def _forget_innovation(n: m.FilterCounters) -> None:
    """Clear the innovation of the tick before."""
    n.fix_white_0 = n.fix_white_1 = n.fix_log_det = math.nan


@kernel
def _note_fix(tick: int, fix: ReceivedFix, times: FilterTimes) -> None:
    """Note a fix if it is the newest, and not from the future."""
    newest = times.fix
    newer = not times.has_fix or fix.stamp_s > newest.stamp_s
    if newer and fix.stamp_s <= tick / TICKS_PER_S + _LEAD_S:
        times.has_fix = True
        newest.stamp_s, newest.east_m, newest.north_m = fix.stamp_s, fix.east_m, fix.north_m
        newest.variance_m2, newest.correction_age_s = fix.variance_m2, fix.correction_age_s
        newest.fix, newest.satellites = fix.fix, fix.satellites
        newest.heading_rad, newest.heading_variance_rad2 = fix.heading_rad, fix.heading_variance_rad2


@kernel
def speed_now_mps(computer: Computer) -> float:
    """Return the speed at the end of the tick [m/s].

    The state is the mean of the tick; the accelerometer gives the change over its second half.

    Args:
        computer: (1,) state.
    """
    c = computer[0]
    slot = c.times.tick % m.RING
    x, z = c.filter.states[slot], c.filter.inputs[slot]
    accel_mps2 = c.buffer.accel_mps2 - x[m.ACCEL_BIAS]
    speed_mps: float = x[m.SPEED]
    if math.isnan(accel_mps2):
        return speed_mps
    if z.still and abs(accel_mps2) > JOLT_MPS2:
        return speed_mps
    speed_mps += 0.5 * TICK_S * accel_mps2
    return speed_mps


@kernel
def enter_estimate(computer: Computer, row: Floats) -> None:
    """Enter the estimate at the end of the tick.

    Args:
        computer: (1,) state.
        row: (18,) filled in: pose and twist as in `interface.Estimate`, then their covariances row by row.
    """
    slot = computer[0].times.tick % m.RING
    x, P = computer[0].filter.states[slot], computer[0].filter.covariances[slot]
    row[0], row[1], row[2] = x[m.EAST], x[m.NORTH], x[m.HEADING]
    row[3], row[4] = speed_now_mps(computer), x[m.YAW_RATE]
    claim(computer[0], row[5:14])
    row[14], row[15] = P[m.SPEED, m.SPEED], P[m.SPEED, m.YAW_RATE]
    row[16], row[17] = P[m.YAW_RATE, m.SPEED], P[m.YAW_RATE, m.YAW_RATE]
