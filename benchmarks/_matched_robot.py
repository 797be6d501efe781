"""Robot whose noise is exactly what the 12-state filter assumes, for tests of consistency."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from benchmarks._data_sheets import data_sheets
from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.onboard import filter_model as m
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.estimation.noise import noise_figures
from touchline.onboard.interface import TICK_S, GnssSample, ImuSample, MagSample, SensorFrame
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle

LATENCY_TICKS = 11
SLIP_ANGLE_SHARE = 0.3
"""As in the filter's prediction."""
_BLOCK = 4096


class MatchedRobot:
    """Drives at a given speed and yaw rate; all noise has the figures of `noise_figures`, fixes with a tail."""

    def __init__(self, vehicle: Vehicle, scenario: Scenario, seed: int) -> None:
        """At rest at the origin, heading by the seed."""
        sheets = data_sheets(scenario)
        drive = drive_of(vehicle, sheets.drive.track_width_relative)
        self._drive, self._c = drive.figures, noise_figures(vehicle, sheets, drive)
        c = self._c
        self._rng = np.random.default_rng(seed)
        self._block, self._next = self._rng.standard_normal(_BLOCK).tolist(), 0
        self._radius_m = vehicle.drive.wheel_radius_m
        self.x = self.y = 0.0
        self.heading = 0.61 * seed
        self.speed = self.yaw_rate = 0.0
        self._gyro_bias = self._normal(scenario.imu.gyro_turn_on_bias_radps)
        self._accel_bias = self._normal(scenario.imu.accel_turn_on_bias_mps2)
        self._slip = [self._normal(math.sqrt(c.slip_var[0])) for _ in range(2)]
        self._mag_bias = self._normal(math.sqrt(c.mag_var))
        self._wander = [self._normal(math.sqrt(c.gnss_var)) for _ in range(2)]
        self._slow = [self._normal(math.sqrt(c.slow_var)) for _ in range(2)]
        self._slow_decay = 1.0 - 0.5 * c.q_slow / c.slow_var if c.slow_var > 0.0 else 0.0
        self._angles = [0.0, 0.0]
        self._accel = 0.0
        self._still_var = scenario.imu.accel_density_mps2_rthz**2 * TICK_S
        self._in_flight: deque[tuple[int, GnssSample]] = deque()
        self.tick = 0
        self.silent = False

    @property
    def pose(self) -> tuple[float, float, float]:
        """(x m, y m, heading rad)."""
        return self.x, self.y, self.heading

    def step(self, speed: float, yaw_rate: float) -> SensorFrame:
        """A tick at that mean speed [m/s] and yaw rate [rad/s]."""
        c = self._c
        self.tick += 1
        change, self.speed, self.yaw_rate = speed - self.speed, speed, yaw_rate
        moving = speed != 0.0 or yaw_rate != 0.0
        drift = c.side_slip_rad_per_mps2 * speed * yaw_rate
        middle = self.heading + 0.5 * yaw_rate * TICK_S - drift
        unsure = SLIP_ANGLE_SHARE * drift
        side = self._normal(math.sqrt((c.q_side_m + unsure * unsure) * abs(speed) * TICK_S))
        self.x += speed * TICK_S * math.cos(middle) - side * math.sin(middle)
        self.y += speed * TICK_S * math.sin(middle) + side * math.cos(middle)
        self.heading += yaw_rate * TICK_S
        self._gyro_bias += self._normal(math.sqrt(c.q_gyro_bias))
        self._accel_bias += self._normal(math.sqrt(c.q_accel_bias))
        self._slip = [self._markov(value, c.slip_decay[0], c.slip_var[0]) for value in self._slip]
        self._wander = [self._markov(value, c.gnss_decay, c.gnss_var) for value in self._wander]
        self._slow = [self._markov(value, self._slow_decay, c.slow_var) for value in self._slow]
        self._mag_bias = self._markov(self._mag_bias, c.mag_decay, c.mag_var)
        self._mag_bias += self._normal(math.sqrt(c.mag_var * min(abs(yaw_rate) * TICK_S, 1.0)))
        return self._sense(change, moving)

    def _sense(self, change: float, moving: bool) -> SensorFrame:
        c = self._c
        gyro = self.yaw_rate + self._gyro_bias + self._normal(math.sqrt(c.r_gyro))
        # The filter takes the mean of two samples for what the mean speed changed by.
        self._accel = 2.0 * change / TICK_S - self._accel
        shaking = c.q_speed if moving else self._still_var
        accel = self._accel + self._accel_bias + self._normal(math.sqrt(shaking) / TICK_S)
        half = self._drive.half_track_m
        noise = math.sqrt(self._drive.encoder_var + (self._drive.track_share * half * self.yaw_rate) ** 2)
        for i, sign in enumerate((-1.0, 1.0)):
            if moving:
                rim = (self.speed + sign * half * self.yaw_rate + self._normal(noise)) / (1.0 - self._slip[i])
                self._angles[i] += rim * TICK_S / self._radius_m
        seen = self.heading + self._mag_bias + self._normal(math.sqrt(c.r_mag))
        fixes: tuple[GnssSample, ...] = ()
        if self.tick % 10 == 0 and not self.silent:
            # Of a Student-t distribution, both axes as bad as each other.
            kind = float(self._rng.chisquare(m.FIX_DOF)) / (m.FIX_DOF - 2.0)
            white = math.sqrt(c.r_gnss / kind)
            off = [sum(slow) + self._normal(white) for slow in zip(self._wander, self._slow, strict=True)]
            east, north = self.x + off[0], self.y + off[1]
            variance = float(c.r_gnss + c.gnss_var + c.slow_var)
            sample = GnssSample(self.tick * TICK_S, east, north, variance, 3, 20, 0.5)
            self._in_flight.append((self.tick + LATENCY_TICKS, sample))
        if self._in_flight and self._in_flight[0][0] <= self.tick:
            fixes = (self._in_flight.popleft()[1],)
        return SensorFrame(
            self.tick,
            self.tick * TICK_S,
            ImuSample(0.0, 0.0, gyro, accel, self._accel_bias + self.speed * self.yaw_rate, GRAVITY_MPS2),
            MagSample(1.7e-5 * math.sin(seen), 1.7e-5 * math.cos(seen), -4.8e-5),
            tuple(self._angles),
            fixes,
        )

    def _markov(self, value: float, decay: float, variance: float) -> float:
        return decay * value + self._normal(math.sqrt(variance * (1.0 - decay * decay)))

    def _normal(self, sigma: float) -> float:
        if self._next >= _BLOCK:
            self._block, self._next = self._rng.standard_normal(_BLOCK).tolist(), 0
        self._next += 1
        return sigma * float(self._block[self._next - 1])
