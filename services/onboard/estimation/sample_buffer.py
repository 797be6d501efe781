"""The sample buffer: enters each sample of a frame in the tick in which it was measured.

A sample that comes late is entered late, and the filter runs again from there; one that never comes leaves its row
empty (nan), and the filter predicts over it.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.vehicles import Vehicle
from touchline.services.onboard.estimation import model as m
from touchline.services.onboard.interface import TICK_S, ImuSample, SensorFrame

STILL_RAD: Final = 1e-4
"""Wheel angle in a tick below which the wheel stands (1 mm/s)."""
STILL_TICKS: Final = 20
MAG_EVERY_TICKS: Final = 10
"""The magnetometer's error is a slow one: more samples say nothing new and cost time."""
OLDEST_TICKS: Final = m.RING - 2
FROZEN_RADPS: Final = 0.05
"""If the IMU repeats itself while the wheels' rates have changed by so much, it is frozen: that is no new sample."""


class Intake:
    """See the module.

    Attributes:
        still_ticks: For how long no wheel has turned.
        accel_mps2: The newest forward acceleration.
        imu_tick, encoder_tick: In which the newest samples were measured; −1 before the first.
        encoder_rates: The newest rates of the wheels (left, right) [rad/s].
    """

    def __init__(self, vehicle: Vehicle) -> None:
        """Nothing has come yet."""
        self._radius_m = vehicle.drive.wheel_radius_m
        self.imu_tick = self.encoder_tick = self._mag_tick = -1
        self.still_ticks = 0
        self.accel_mps2 = 0.0
        self.encoder_rates = (0.0, 0.0)
        self._left_rad = self._right_rad = 0.0
        self._reading: ImuSample | None = None
        self._rates_then = (0.0, 0.0)

    def take(self, frame: SensorFrame, inputs: NDArray[np.float64]) -> tuple[int, int]:
        """Enter a frame in `inputs` (RING, INPUTS); its row is emptied first.

        Returns:
            The oldest tick that learned something new, and the newest tick with wheel angles.
        """
        tick = frame.tick
        row = inputs[tick % m.RING]
        row[:] = math.nan
        row[m.IN_STILL] = 0.0
        oldest = min(tick, self._imu(frame, inputs), self._encoders(frame, inputs), self._mag(frame, inputs))
        return oldest, self.encoder_tick

    def _imu(self, frame: SensorFrame, inputs: NDArray[np.float64]) -> int:
        sampled = frame.tick - frame.imu_age_ticks
        if sampled <= self.imu_tick or frame.imu_age_ticks > OLDEST_TICKS:
            return frame.tick
        if frame.imu != self._reading:
            self._reading, self._rates_then = frame.imu, self.encoder_rates
        elif any(abs(a - b) > FROZEN_RADPS for a, b in zip(self.encoder_rates, self._rates_then, strict=True)):
            return frame.tick
        accel = frame.imu.accel_x_mps2
        before = self.accel_mps2 if sampled == self.imu_tick + 1 else accel
        row = inputs[sampled % m.RING]
        row[m.IN_GYRO] = frame.imu.gyro_z_radps
        row[m.IN_ACCEL] = 0.5 * (accel + before)
        row[m.IN_SIDE] = frame.imu.accel_y_mps2
        self.accel_mps2, self.imu_tick = accel, sampled
        return sampled

    def _encoders(self, frame: SensorFrame, inputs: NDArray[np.float64]) -> int:
        sampled = frame.tick - frame.encoder_age_ticks
        if sampled <= self.encoder_tick or frame.encoder_age_ticks > OLDEST_TICKS:
            return frame.tick
        left, right = frame.encoders
        span = sampled - self.encoder_tick
        first, self.encoder_tick = self.encoder_tick < 0, sampled
        turned_left, turned_right = left - self._left_rad, right - self._right_rad
        self._left_rad, self._right_rad = left, right
        if first:  # nothing to compare with yet
            turned_left = turned_right = 0.0
            span = 1
        still = abs(turned_left) < STILL_RAD * span and abs(turned_right) < STILL_RAD * span
        self.still_ticks = self.still_ticks + span if still else 0
        self.encoder_rates = (turned_left / (span * TICK_S), turned_right / (span * TICK_S))
        row = inputs[sampled % m.RING]
        row[m.IN_LEFT] = self.encoder_rates[0] * self._radius_m
        row[m.IN_RIGHT] = self.encoder_rates[1] * self._radius_m
        row[m.IN_SPAN] = span
        row[m.IN_STILL] = 1.0 if self.still_ticks >= STILL_TICKS else 0.0
        return sampled

    def _mag(self, frame: SensorFrame, inputs: NDArray[np.float64]) -> int:
        sampled = frame.tick - frame.mag_age_ticks
        if sampled <= self._mag_tick or sampled % MAG_EVERY_TICKS or frame.mag_age_ticks > OLDEST_TICKS:
            return frame.tick
        self._mag_tick = sampled
        inputs[sampled % m.RING, m.IN_MAG] = math.atan2(frame.mag.x_t, frame.mag.y_t)
        return sampled
