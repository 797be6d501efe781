"""Step of the filter from one tick to the next: prediction, and all measurements but positions."""

from __future__ import annotations

from typing import Any

from touchline.core.jit import kernel
from touchline.onboard.computer_state import FilterState
from touchline.onboard.drives import onboard_drive
from touchline.onboard.estimation.adaptation import add_wander
from touchline.onboard.estimation.aiding.imu_aiding import add_pitching_noise, add_shaking_noise, forward_acceleration
from touchline.onboard.estimation.bursts import carry_modes
from touchline.onboard.estimation.measurements import measure
from touchline.onboard.estimation.prediction import add_scale_error, predict
from touchline.onboard.estimation.tick_estimate import Scratch, TickEstimate
from touchline.onboard.filter_model import EAST, NORTH, STATES


@kernel
def step(last: TickEstimate, at: TickEstimate, ring: FilterState, drive: Any, live: bool, scratch: Scratch) -> None:
    """Predict and update: compute the posterior of a tick from that of the tick before.

    Args:
        last: The tick before.
        at: The tick with its inputs; state and covariance are filled in.
        ring: Figures, learned ones and counters, of which the last are updated.
        drive: Figures of the drive.
        live: Whether the measurements are new.
        scratch: Overwritten.
    """
    c, x, P, z, before = ring.figures, at.x, at.P, at.z, last.z
    for i in range(STATES):
        x[i] = last.x[i]
        for k in range(STATES):
            P[i, k] = last.P[i, k]
    # The fixes have put the position where it is: it moves with what is learned of the mast's lean.
    x[EAST] += c.mast_s2 * (z.rise_east_mps2 - before.rise_east_mps2)
    x[NORTH] += c.mast_s2 * (z.rise_north_mps2 - before.rise_north_mps2)
    onboard_drive.smooth(drive, before, z)
    carry_modes(before, z, c)
    predict(x, P, forward_acceleration(x, P, before, z, c), z, c)
    if c.scale_var > 0.0:
        add_scale_error(last.x, x, P, c.scale_var, ring.learned)
    if z.wander > 0.0:
        add_wander(x, P, z.wander)
    # Readings that are rejected again and again are counted: the drive may have an explanation.
    z.refused_ticks = before.refused_ticks
    z.lean[0], z.lean[1] = before.lean[0], before.lean[1]
    onboard_drive.strain(drive, P, before, z)
    add_shaking_noise(P, before, z)
    add_pitching_noise(P, before, z)
    measure(at, c, drive, ring.counters, live, scratch)
