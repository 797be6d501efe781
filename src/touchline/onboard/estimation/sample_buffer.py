"""Sample buffer: enters each sample of a frame in the tick in which it was measured.

A sample that comes late is entered late, and the filter runs again from there; one that never comes leaves its row
empty (nan), and the filter predicts without it.
"""

from __future__ import annotations

from typing import Any, Final

from touchline.core.jit import kernel
from touchline.onboard.computer_state import ComputerState
from touchline.onboard.estimation.aiding.encoder_aiding import take_encoders
from touchline.onboard.estimation.aiding.imu_aiding import take_imu
from touchline.onboard.estimation.aiding.magnetometer_aiding import take_magnetometer
from touchline.onboard.filter_model import RING

OLDEST_TICKS: Final = RING - 2
"""Ticks before this one back to which a sample is entered."""


@kernel
def take_samples(tick: int, drive: Any, c: ComputerState) -> int:
    """Enter the samples of a tick's frame in the filter's inputs; the tick's own row is emptied first.

    Args:
        tick: This tick.
        drive: Figures of the drive.
        c: State with the frame; buffer and inputs are updated.

    Returns:
        The oldest tick with a new sample; `tick` if there is none.
    """
    c.filter.inputs[tick % RING] = c.filter.no_inputs
    frame, earliest, oldest = c.frame, tick - OLDEST_TICKS, tick
    if frame.imu_tick >= earliest and take_imu(c):
        oldest = min(oldest, frame.imu_tick)
    if frame.mag_tick >= earliest and take_magnetometer(c):
        oldest = min(oldest, frame.mag_tick)
    if frame.encoder_tick >= earliest and take_encoders(drive, c):
        oldest = min(oldest, frame.encoder_tick)
    return oldest
