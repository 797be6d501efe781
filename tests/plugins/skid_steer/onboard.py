"""The onboard side: v = (v_left + v_right)/2, ω = (v_right − v_left)/(2·b), with b half the track it turns about.

The drive's two states of the filter are the slips of the sides; a side's speed is the mean of its two wheels.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tests.plugins.skid_steer.spec import WHEELS
from touchline.core.jit import kernel
from touchline.onboard.computer_state import SampleBuffer
from touchline.onboard.drives.onboard_drive import OnboardDrive
from touchline.onboard.drives.slip import SLIP_LIMIT, STILL_RAD, smooth_rim, strain_slip
from touchline.onboard.filter_model import ODOMETRY_ERROR, SPEED, YAW_RATE, TickInputs
from touchline.onboard.interface import TICK_S
from touchline.onboard.tracking_state import EFFECT
from touchline.onboard.tracking_state import SPEED as SPEED_NOW
from touchline.onboard.tracking_state import YAW_RATE as YAW_RATE_NOW
from touchline.schemas.errors import CommandRefused
from touchline.schemas.vehicles import Vehicle

Floats = NDArray[np.float64]
SLACK = 1.001
SIDE_SLIP_RAD_PER_MPS2 = 0.02


class SkidSteerFigures(NamedTuple):
    """Figures of it for kernels; wheel i is on side i % 2, left or right."""

    radius_m: float
    half_m: float
    max_rate_radps: float
    reach_radps: float
    odometry_var: float
    turning_share: float

    @kernel
    def read(self, span: int, buffer: SampleBuffer, row: TickInputs) -> bool:
        still = True
        row.odometry[0], row.odometry[1] = 0.0, 0.0
        for wheel in range(len(buffer.measured)):
            turned = buffer.turned_rad[wheel]
            still = still and abs(turned) < STILL_RAD * span
            buffer.measured[wheel] = turned / (span * TICK_S)
            row.odometry[wheel % 2] += 0.5 * buffer.measured[wheel] * self.radius_m
        return still

    @kernel
    def smooth(self, before: TickInputs, z: TickInputs) -> None:
        for side in range(2):
            smooth_rim(side, before, z)

    @kernel
    def strain(self, P: Floats, before: TickInputs, z: TickInputs) -> None:
        if not math.isnan(z.accel_mps2):
            for side in range(2):
                strain_slip(side, P, before, z)

    @kernel
    def odometry(self, x: Floats, z: TickInputs, h: Floats) -> tuple[float, float, float]:
        h[0, SPEED], h[0, YAW_RATE], h[0, ODOMETRY_ERROR] = 1.0, -self.half_m, z.smooth[0]
        h[1, SPEED], h[1, YAW_RATE], h[1, ODOMETRY_ERROR + 1] = 1.0, self.half_m, z.smooth[1]
        y0 = z.odometry[0] - z.smooth[0] * x[ODOMETRY_ERROR] - (x[SPEED] - self.half_m * x[YAW_RATE])
        y1 = z.odometry[1] - z.smooth[1] * x[ODOMETRY_ERROR + 1] - (x[SPEED] + self.half_m * x[YAW_RATE])
        return y0, y1, self.odometry_var + (self.turning_share * self.half_m * x[YAW_RATE]) ** 2

    @kernel
    def effective(self, x: Floats, now: Floats) -> None:
        for side in range(2):
            slip = min(max(x[ODOMETRY_ERROR + side], -SLIP_LIMIT), SLIP_LIMIT)
            now[EFFECT + side] = self.radius_m * (1.0 - slip)

    @kernel
    def twist(self, actuators: Floats, now: Floats) -> tuple[float, float]:
        left = 0.5 * (actuators[0] + actuators[2]) * now[EFFECT]
        right = 0.5 * (actuators[1] + actuators[3]) * now[EFFECT + 1]
        return 0.5 * (left + right), 0.5 * (right - left) / self.half_m

    @kernel
    def actuators_of(self, speed_mps: float, yaw_rate_radps: float, now: Floats) -> tuple[float, float, float, float]:
        left = (speed_mps - self.half_m * yaw_rate_radps) / now[EFFECT]
        right = (speed_mps + self.half_m * yaw_rate_radps) / now[EFFECT + 1]
        return left, right, left, right

    @kernel
    def gain(self, actuator: int, now: Floats) -> tuple[float, float]:
        side = actuator % 2
        speed = 0.25 * now[EFFECT + side]
        return speed, (2 * side - 1) * speed / self.half_m

    @kernel
    def command(self, speed_mps: float, yaw_rate_radps: float, now: Floats, actuators: Floats) -> None:
        most = abs(speed_mps) + self.half_m * abs(yaw_rate_radps)
        scale = min(1.0, self.max_rate_radps * self.radius_m * (1.0 - SLIP_LIMIT) / max(most, 1e-9))
        for wheel in range(len(actuators)):
            apart = (2 * (wheel % 2) - 1) * self.half_m
            radius = now[EFFECT + wheel % 2]
            there = (now[SPEED_NOW] + apart * now[YAW_RATE_NOW]) / radius
            rate = scale * (speed_mps + apart * yaw_rate_radps) / radius
            rate = min(max(rate, there - self.reach_radps), there + self.reach_radps)
            actuators[wheel] = min(max(rate, -self.max_rate_radps), self.max_rate_radps)


class OnboardSkidSteer(OnboardDrive):
    def __init__(self, vehicle: Vehicle, track_width_relative: float) -> None:
        drive, count = vehicle.drive, len(WHEELS)
        self._max_speed_mps, self._acceleration_mps2 = drive.max_speed_mps, drive.max_acceleration_mps2
        self.lag_s, self.side_slip_rad_per_mps2 = max(drive.motor_time_constant_s, TICK_S), SIDE_SLIP_RAD_PER_MPS2
        reach_radps = drive.max_wheel_acceleration_radps2 * self.lag_s
        self.limit, self.reach = np.full(count, drive.max_wheel_speed_radps), np.full(count, reach_radps)
        self.lag_share = np.full(count, -math.expm1(-TICK_S / self.lag_s))
        self.max_step = np.full(count, drive.max_wheel_acceleration_radps2 * TICK_S)
        self.tolerance, self.tolerance_share = np.full(count, 0.7), np.full(count, 0.4)
        self.disobeyed = tuple(f"the {name} wheel does not turn as commanded" for name in WHEELS)
        self.figures = SkidSteerFigures(
            drive.wheel_radius_m,
            drive.half_turning_m,
            drive.max_wheel_speed_radps,
            reach_radps,
            drive.encoder_mps**2 + 0.002**2,
            max(track_width_relative, 0.05),
        )

    def moves_mps(self, actuators: Floats) -> float:
        return float(np.abs(actuators).max() * self.figures.radius_m)

    def check_curvature(self, name: str, curvature_1pm: float) -> None:
        if abs(curvature_1pm) * self.figures.half_m > 1.0:
            raise CommandRefused(f"{name} is so tight that the inner wheels would have to run backward")

    def check_speeds(self, speed_mps: Floats, curvature_1pm: Floats, name: Callable[[int], str]) -> None:
        rim_mps = speed_mps * (1.0 + np.abs(curvature_1pm) * self.figures.half_m)
        if rim_mps.max() > self._max_speed_mps * SLACK:
            raise CommandRefused(f"{name(int(np.argmax(rim_mps)))} is too fast for the wheels")

    def check_spin(self, name: str, rate_radps: float) -> None:
        if rate_radps * self.figures.half_m > self._max_speed_mps * SLACK:
            raise CommandRefused(f"{name} turns too fast for the wheels")

    def spin_acceleration_radps2(self) -> float:
        return float(self._acceleration_mps2 / self.figures.half_m)
