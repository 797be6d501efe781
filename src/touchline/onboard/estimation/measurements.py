"""Measurements of a tick: the updates of all sensors in their order.

Updates are sequential and scalar: P ← P − (PHᵀ)(PHᵀ)ᵀ/S keeps P symmetric to the bit. Where a sensor measures two
numbers at once its gate is one χ² test with two degrees of freedom on both. Each sensor's part is in `aiding`.
"""

from __future__ import annotations

import math
from typing import Any

from touchline.core.jit import borrowing
from touchline.onboard.estimation.adaptation import has_jumped
from touchline.onboard.estimation.aiding.camera_aiding import share_of_poses, use_heading
from touchline.onboard.estimation.aiding.encoder_aiding import use_encoders
from touchline.onboard.estimation.aiding.gnss_aiding import (
    passes_doubt,
    position_fit,
    set_slow_error_aside,
    use_position,
)
from touchline.onboard.estimation.aiding.imu_aiding import use_gyro
from touchline.onboard.estimation.aiding.magnetometer_aiding import use_magnetometer
from touchline.onboard.estimation.consistency_monitor import note_innovation
from touchline.onboard.estimation.tick_estimate import Scratch, TickEstimate
from touchline.onboard.filter_model import HEADING, SPEED, FilterCounters, FilterFigures, FixInTick

_CLEAR_JUMP_SHARE = 0.8  # of the distance to a rejected fix, in one step: bursts take several


@borrowing
def measure(at: TickEstimate, c: FilterFigures, drive: Any, n: FilterCounters, live: bool, scratch: Scratch) -> None:
    """Update the prediction of a tick with the measurements of gyro, encoders and magnetometer.

    Args:
        at: Tick with predicted state and covariance, which are updated.
        c: Figures of the filter.
        drive: Figures of the drive.
        n: Counters, updated if the tick is live.
        live: Whether its measurements are new.
        scratch: Overwritten.
    """
    use_gyro(at, c, n, live, scratch)
    use_encoders(at, drive, n, live, scratch)
    use_magnetometer(at, c, n, live, scratch)


@borrowing
def accept_fix(at: TickEstimate, fix: FixInTick, c: FilterFigures, n: FilterCounters, scratch: Scratch) -> bool:
    """Return whether a fix is to be used, by its position and, of a camera's pose, its heading.

    Args:
        at: Tick in which the fix is valid.
        fix: The fix.
        c: Figures of the filter.
        n: Counters, updated.
        scratch: Overwritten.
    """
    h, _, _ = scratch
    set_slow_error_aside(at.P, c.slow_var)
    nis, share = position_fit(at, fix, c, n, h)
    set_slow_error_aside(at.P, -c.slow_var)
    if not math.isnan(fix.heading_rad):
        share = share_of_poses(share, at, fix, n, h[0])
    accepted: bool = passes_doubt(c, n, nis, share)
    if accepted or not has_jumped(n, _CLEAR_JUMP_SHARE):
        note_innovation(n, at.x[HEADING], at.x[SPEED], c.burst_var > 0.0)
    return accepted


@borrowing
def use_fix(at: TickEstimate, fix: FixInTick, c: FilterFigures, scratch: Scratch) -> None:
    """Update the tick in which a fix is valid with its position and, of a camera's pose, its heading.

    Args:
        at: Tick, whose state and covariance are updated.
        fix: The fix.
        c: Figures of the filter.
        scratch: Overwritten.
    """
    set_slow_error_aside(at.P, c.slow_var)
    weighed_m2 = use_position(at, fix, c, scratch)
    set_slow_error_aside(at.P, -c.slow_var)
    if not math.isnan(fix.heading_rad):
        use_heading(at, fix, weighed_m2, scratch)
