"""Magnetometer in the filter: a heading with a slow error."""

from __future__ import annotations

import math
from typing import Final

from touchline.core.angles import wrapped
from touchline.core.jit import borrowing, kernel
from touchline.onboard.computer_state import ComputerState
from touchline.onboard.estimation.gauss_markov import one_term
from touchline.onboard.estimation.tick_estimate import Scratch, TickEstimate
from touchline.onboard.estimation.updates import apply
from touchline.onboard.filter_model import (
    GATE_1_DOF,
    HEADING,
    MAG_BIAS,
    RING,
    STATES,
    VARYING,
    FilterCounters,
    FilterFigures,
)
from touchline.onboard.interface import MAG, TICK_S
from touchline.schemas.onboard import OnboardConfig

MAG_EVERY_TICKS: Final = 10
"""Ticks between two samples that are used: as the error is a slow one, more say nothing new and cost time."""
_FLOOR_RAD = 0.005


def magnetometer_figures(c: FilterFigures, config: OnboardConfig) -> None:
    """Fill in the noise figures of the magnetometer.

    Args:
        c: Figures of the filter, updated.
        config: Configuration, which has the data sheet.
    """
    mag = config.magnetometer
    c.mag_var, tau = one_term(((max(mag.bias_rad, 0.01), 1e4), (max(mag.disturbance_rad, 0.01), mag.disturbance_tau_s)))
    c.mag_decay = math.exp(-TICK_S / tau)
    c.r_mag = max(mag.white_rad, _FLOOR_RAD) ** 2


@kernel
def take_magnetometer(c: ComputerState) -> bool:
    """Enter every tenth sample as a heading in the inputs of its tick, unless it is an old one.

    Args:
        c: State with the frame; buffer and inputs are updated.

    Returns:
        Whether the sample is entered.
    """
    state, sampled = c.buffer, c.frame.mag_tick
    if sampled <= state.mag_tick or sampled % MAG_EVERY_TICKS != 0:
        return False
    state.mag_tick = sampled
    c.filter.inputs[sampled % RING].mag_rad = math.atan2(c.frame.readings[MAG], c.frame.readings[MAG + 1])
    return True


@borrowing
def use_magnetometer(at: TickEstimate, c: FilterFigures, n: FilterCounters, live: bool, scratch: Scratch) -> None:
    """Update with the magnetic heading: heading plus the magnetometer's error, behind a gate.

    Args:
        at: Tick, whose state and covariance are updated.
        c: Figures of the filter.
        n: Counters, updated if the tick is live.
        live: Whether the measurement is new.
        scratch: Overwritten.
    """
    x, P, z = at
    h, g, _ = scratch
    row = h[0]
    if math.isnan(z.mag_rad):
        return
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
        apply(x, P, row, y, c.r_mag, g, VARYING)
