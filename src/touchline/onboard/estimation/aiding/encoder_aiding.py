"""Encoders in the filter: odometry of the drive, and standstill.

They do not teach the constants of the robot: wheels that slip would be taken for a gyro that reads too much.
"""

from __future__ import annotations

import math
from typing import Any, Final

from touchline.core.jit import borrowing, kernel
from touchline.onboard.computer_state import ComputerState
from touchline.onboard.drives import onboard_drive
from touchline.onboard.drives.onboard_drive import OnboardDrive
from touchline.onboard.estimation.adaptation import doubted_variance
from touchline.onboard.estimation.aiding.imu_aiding import STILL_YAW_VAR
from touchline.onboard.estimation.gauss_markov import bridging_term
from touchline.onboard.estimation.tick_estimate import Scratch, TickEstimate
from touchline.onboard.estimation.updates import apply, apply_two, nis_of_two
from touchline.onboard.filter_model import (
    ANTENNA_Y,
    GATE_2_DOF,
    RING,
    SPEED,
    STATES,
    VARYING,
    YAW_RATE,
    FilterCounters,
    FilterFigures,
)
from touchline.onboard.interface import ANGLES, TICK_S
from touchline.schemas.onboard import OnboardConfig

STILL_TICKS: Final = 20
"""Ticks without motion of the drive after which the robot stands."""
_STILL_SPEED_VAR = 1e-6  # (1 mm/s)²
_SLIP_RECENT = 1.0 / 30.0  # weight of the newest tick in the slip test
_LEAN_SHARE = 1.0 / 50.0  # weight of the newest tick
_SPAN_ACCEL_MPS2 = 1.0
_REJECTED_RUN_LIMIT = 50
_PATIENCE = 100.0  # factor on the encoders' variance once they have been rejected for half a second
_SLIP_FLOOR = 0.002
_MEAN_SLIP = 0.007  # 1 σ: rolling resistance takes half a per cent
_LEARNED_SLIP = 0.004  # 1 σ of what is left of it once it has been learned


def encoder_figures(c: FilterFigures, config: OnboardConfig, drive: OnboardDrive, fix_rate_hz: float) -> None:
    """Fill in the noise figures of odometry and of side slip.

    Args:
        c: Figures of the filter, updated.
        config: Configuration, which has the slip.
        drive: Drive of the vehicle.
        fix_rate_hz: Rate of the fixes by which the mean slip is learned.
    """
    sheet = config.drive
    if drive.slip_hides_arm:
        c.considered = ANTENNA_Y
    fast = max(sheet.slip_relative, _SLIP_FLOOR) ** 2
    for i, lasting in enumerate(drive.lasting_errors):
        if lasting is None:
            c.slip_var[i], tau = bridging_term(fast, sheet.slip_tau_s, _LEARNED_SLIP**2)
            c.mean_slip_var[i] = _MEAN_SLIP**2
            c.r_mean_slip[i] = fast * 2.0 * sheet.slip_tau_s * fix_rate_hz
        else:  # it stays where it is found, so there is no mean to be learned
            c.slip_var[i], tau = lasting.sigma**2, lasting.tau_s
            c.r_mean_slip[i] = math.inf
        c.slip_decay[i] = math.exp(-TICK_S / tau)
    c.q_side_m = sheet.side_slip_m_rtm**2
    c.side_slip_rad_per_mps2 = drive.side_slip_rad_per_mps2


@kernel
def take_encoders(drive: Any, c: ComputerState) -> bool:
    """Enter in the inputs of its tick what the encoders have turned since the sample before, unless it is an old one.

    Args:
        drive: Figures of the drive.
        c: State with the frame; buffer and inputs are updated.

    Returns:
        Whether the sample is entered.
    """
    state, sampled = c.buffer, c.frame.encoder_tick
    if sampled <= state.encoder_tick:
        return False
    first = state.encoder_tick < 0  # nothing to compare with yet
    span = 1 if first else sampled - state.encoder_tick
    state.encoder_tick = sampled
    row = c.filter.inputs[sampled % RING]
    for actuator in range(len(state.angles_rad)):
        angle = c.frame.readings[ANGLES + actuator]
        state.turned_rad[actuator] = 0.0 if first else angle - state.angles_rad[actuator]
        state.angles_rad[actuator] = angle
    still = onboard_drive.read(drive, span, state, row)
    state.still_ticks = state.still_ticks + span if still else 0
    row.span_ticks = span
    row.still = state.still_ticks >= STILL_TICKS
    return True


@borrowing
def use_encoders(at: TickEstimate, drive: Any, n: FilterCounters, live: bool, scratch: Scratch) -> None:
    """Update with the encoders: no speed and no yaw rate at standstill, else the odometry of the drive.

    Args:
        at: Tick, whose state and covariance are updated.
        drive: Figures of the drive.
        n: Counters, updated if the tick is live.
        live: Whether the measurement is new.
        scratch: Overwritten.
    """
    x, P, z = at
    h, g = scratch
    if z.still:
        row = h[0]
        z.refused_ticks = 0
        for k in range(STATES):
            row[k] = 0.0
        row[SPEED] = 1.0
        apply(x, P, row, -x[SPEED], _STILL_SPEED_VAR, g, VARYING)
        row[SPEED], row[YAW_RATE] = 0.0, 1.0
        apply(x, P, row, -x[YAW_RATE], STILL_YAW_VAR, g, VARYING)
        if live:
            n.encoders_rejected_recent -= _SLIP_RECENT * n.encoders_rejected_recent
    elif not math.isnan(z.odometry[0]):
        _use_odometry(at, drive, n, live, scratch)


@borrowing
def _use_odometry(at: TickEstimate, drive: Any, n: FilterCounters, live: bool, scratch: Scratch) -> None:
    """Update with the drive's odometry, behind one gate for both of its numbers."""
    x, P, z = at
    h, _ = scratch
    for k in range(STATES):
        h[0, k], h[1, k] = 0.0, 0.0
    y0, y1, r = onboard_drive.odometry(drive, x, z, h)
    uneven = 0.5 * (z.span_ticks - 1.0) * TICK_S * _SPAN_ACCEL_MPS2  # the mean of several ticks is not the last one
    r += uneven * uneven
    y = y0, y1
    if math.isnan(z.accel_mps2):
        r = doubted_variance(P, y, r)
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
        if n.encoders_rejected_run < _REJECTED_RUN_LIMIT:
            return
        r *= _PATIENCE
    apply_two(x, P, scratch, y, r, VARYING, STATES)
