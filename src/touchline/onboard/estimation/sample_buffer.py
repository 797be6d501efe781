"""The sample buffer: enters each sample of a frame in the tick in which it was measured.

A sample that comes late is entered late, and the filter runs again from there; one that never comes leaves its row
empty (nan), and the filter predicts over it.
"""

from __future__ import annotations

import math
from typing import Any, Final

from touchline.core.jit import kernel
from touchline.onboard import filter_model as m
from touchline.onboard.computer_state import ComputerState
from touchline.onboard.drives import onboard_drive
from touchline.onboard.interface import ACCEL, ANGLES, MAG

STILL_TICKS: Final = 20
MAG_EVERY_TICKS: Final = 10
"""The magnetometer's error is a slow one: more samples say nothing new and cost time."""
OLDEST_TICKS: Final = m.RING - 2
FROZEN_RADPS: Final = 0.05
"""If the IMU repeats itself while the wheels' rates have changed by so much, it is frozen: that is no new sample."""


@kernel
def take_samples(tick: int, drive: Any, c: ComputerState) -> int:
    """Enter the samples of a tick's frame in the filter's inputs; the tick's own row is emptied first.

    Args:
        tick: This tick.
        drive: Figures of the drive.
        c: With the frame; buffer and inputs are updated.

    Returns:
        The oldest tick with a new sample; `tick` if there is none.
    """
    c.filter.inputs[tick % m.RING] = c.filter.no_inputs
    frame, earliest, oldest = c.frame, tick - OLDEST_TICKS, tick
    if frame.imu_tick >= earliest and _take_imu(c):
        oldest = min(oldest, frame.imu_tick)
    if frame.mag_tick >= earliest and _take_magnetometer(c):
        oldest = min(oldest, frame.mag_tick)
    if frame.encoder_tick >= earliest and _take_encoders(drive, c):
        oldest = min(oldest, frame.encoder_tick)
    return oldest


@kernel
def _frozen(c: ComputerState) -> bool:
    """Whether the IMU repeats itself while the wheels change their rates; a new reading is remembered."""
    state = c.buffer
    new = state.imu_tick < 0
    for axis in range(6):
        new = new or c.frame.readings[axis] != state.reading[axis]
        state.reading[axis] = c.frame.readings[axis]
    if new or not state.repeated:
        # The encoders are read behind the IMU: what the wheels did at a reading is known when the next one comes.
        for actuator in range(len(state.measured)):
            state.measured_then[actuator] = state.measured[actuator]
        state.repeated = not new
        return False
    change = 0.0
    for actuator in range(len(state.measured)):
        change = max(change, abs(state.measured[actuator] - state.measured_then[actuator]))
    return change > FROZEN_RADPS


@kernel
def _take_imu(c: ComputerState) -> bool:
    """Enter a sample of the IMU, unless it is an old or a frozen one; the acceleration is the mean of two."""
    state, sampled = c.buffer, c.frame.imu_tick
    if sampled <= state.imu_tick or _frozen(c):
        return False
    accel = c.frame.readings[ACCEL]
    before = state.accel_mps2 if sampled == state.imu_tick + 1 else accel
    row = c.filter.inputs[sampled % m.RING]
    row.gyro_radps = c.frame.readings[2]
    row.accel_mps2 = 0.5 * (accel + before)
    row.side_mps2 = c.frame.readings[ACCEL + 1]
    state.accel_mps2 = accel
    state.imu_tick = sampled
    return True


@kernel
def _take_encoders(drive: Any, c: ComputerState) -> bool:
    """Enter what the encoders have turned since the sample before, unless this is an old one."""
    state, sampled = c.buffer, c.frame.encoder_tick
    if sampled <= state.encoder_tick:
        return False
    first = state.encoder_tick < 0  # nothing to compare with yet
    span = 1 if first else sampled - state.encoder_tick
    state.encoder_tick = sampled
    row = c.filter.inputs[sampled % m.RING]
    for actuator in range(len(state.angles_rad)):
        angle = c.frame.readings[ANGLES + actuator]
        state.turned_rad[actuator] = 0.0 if first else angle - state.angles_rad[actuator]
        state.angles_rad[actuator] = angle
    still = onboard_drive.read(drive, span, state, row)
    state.still_ticks = state.still_ticks + span if still else 0
    row.span_ticks = span
    row.still = state.still_ticks >= STILL_TICKS
    return True


@kernel
def _take_magnetometer(c: ComputerState) -> bool:
    """Enter every tenth sample of the magnetometer as a heading, unless it is an old one."""
    state, sampled = c.buffer, c.frame.mag_tick
    if sampled <= state.mag_tick or sampled % MAG_EVERY_TICKS != 0:
        return False
    state.mag_tick = sampled
    c.filter.inputs[sampled % m.RING].mag_rad = math.atan2(c.frame.readings[MAG], c.frame.readings[MAG + 1])
    return True
