"""Textbook EKF for comparison: pose only, every measurement taken as new and white."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from touchline.onboard.interface import TICK_S, SensorFrame
from touchline.schemas.vehicles import Vehicle

SLIP = 0.02
GYRO_RADPS = 0.003


class PlainEkf:
    """States x, y, heading. Wheel speed and gyro drive it, fixes correct it when they arrive.

    It subtracts the gyro's mean at standstill, knows nothing of latency, slip or slow errors, and gates nothing.
    """

    def __init__(self, vehicle: Vehicle) -> None:
        """Create the filter, which starts at the first fix."""
        self._radius_m = vehicle.drive.wheel_radius_m
        self.state = np.zeros(3)
        self.covariance = np.zeros((3, 3))
        self.started = False
        self._gyro: list[float] = []
        self._angles: tuple[float, ...] | None = None

    @property
    def pose(self) -> tuple[float, float, float]:
        """(x m, y m, heading rad)."""
        x, y, heading = self.state.tolist()
        return x, y, heading

    def step(self, frame: SensorFrame) -> None:
        """Take in a tick."""
        before, self._angles = self._angles, frame.encoders
        if not self.started:
            self._gyro.append(frame.imu.gyro_z_radps)
            if frame.gnss:
                fix = frame.gnss[0]
                self.state[:] = fix.east_m, fix.north_m, math.atan2(frame.mag.x_t, frame.mag.y_t)
                self.covariance = np.diag([fix.variance_m2, fix.variance_m2, math.radians(4.0) ** 2])
                self.started = True
            return
        assert before is not None
        step = 0.5 * self._radius_m * (self._angles[0] - before[0] + self._angles[1] - before[1])
        turn = (frame.imu.gyro_z_radps - sum(self._gyro) / len(self._gyro)) * TICK_S
        self._predict(step, turn)
        for fix in frame.gnss:
            self._correct(np.array([fix.east_m, fix.north_m]), fix.variance_m2)

    def _predict(self, step: float, turn: float) -> None:
        middle = self.state[2] + 0.5 * turn
        cos, sin = math.cos(middle), math.sin(middle)
        self.state += (step * cos, step * sin, turn)
        slope = np.eye(3)
        slope[0, 2], slope[1, 2] = -step * sin, step * cos
        along = (SLIP * step) ** 2
        noise = np.diag([along * cos * cos, along * sin * sin, (GYRO_RADPS * TICK_S) ** 2])
        noise[0, 1] = noise[1, 0] = along * sin * cos
        self.covariance = slope @ self.covariance @ slope.T + noise

    def _correct(self, fix: NDArray[np.float64], variance: float) -> None:
        s = self.covariance[:2, :2] + variance * np.eye(2)
        gain = self.covariance[:, :2] @ np.linalg.inv(s)
        self.state += gain @ (fix - self.state[:2])
        self.covariance = self.covariance - gain @ self.covariance[:2, :]
