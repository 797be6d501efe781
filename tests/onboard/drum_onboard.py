"""The onboard side of a driven drum and a steered wheel behind it: v = ω·r·(1 − s), yaw rate = −v·tan(δ + o)/L.

Its two states of the filter are the drum's slip s and the steering's offset o.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.onboard.computer_state import SampleBuffer
from touchline.onboard.drives import onboard_drive
from touchline.onboard.drives.onboard_drive import OnboardDrive
from touchline.onboard.filter_model import ODOMETRY_ERROR, SPEED, YAW_RATE, TickInputs
from touchline.onboard.interface import TICK_S
from touchline.onboard.tracking_state import COMMAND, EFFECT
from touchline.onboard.tracking_state import SPEED as SPEED_NOW
from touchline.schemas.errors import CommandRefused
from touchline.schemas.vehicles import Vehicle

Floats = NDArray[np.float64]


class DrumFigures(NamedTuple):
    """What kernels know of it."""

    radius_m: float
    base_m: float
    max_rate_radps: float
    max_step_radps: float
    max_steering_rad: float
    max_steering_step_rad: float

    @kernel
    def read(self, span: int, buffer: SampleBuffer, row: TickInputs) -> bool:
        buffer.measured[0] = buffer.turned_rad[0] / (span * TICK_S)
        buffer.measured[1] = buffer.angles_rad[1]
        row.odometry[0] = buffer.measured[0] * self.radius_m
        row.odometry[1] = -row.odometry[0] * math.tan(buffer.measured[1])
        return abs(buffer.turned_rad[0]) < 1e-4 * span

    @kernel
    def smooth(self, before: TickInputs, z: TickInputs) -> None:
        """Slip is a share of the rim speed; the offset one of v(1 + tan²δ), which is v but for sharp turns."""
        z.smooth[0] = z.odometry[0]
        z.smooth[1] = z.odometry[0]

    @kernel
    def strain(self, P: Floats, before: TickInputs, z: TickInputs) -> None:
        """Neither error gets less certain by driving."""

    @kernel
    def odometry(self, x: Floats, z: TickInputs, h: Floats) -> tuple[float, float, float]:
        h[0, SPEED], h[0, ODOMETRY_ERROR] = 1.0, z.smooth[0]
        h[1, YAW_RATE], h[1, ODOMETRY_ERROR + 1] = self.base_m, z.smooth[1]
        y0 = z.odometry[0] - z.smooth[0] * x[ODOMETRY_ERROR] - x[SPEED]
        y1 = z.odometry[1] - z.smooth[1] * x[ODOMETRY_ERROR + 1] - self.base_m * x[YAW_RATE]
        return y0, y1, 0.005**2

    @kernel
    def effective(self, x: Floats, now: Floats) -> None:
        now[EFFECT] = self.radius_m * (1.0 - min(max(x[ODOMETRY_ERROR], -0.05), 0.05))
        now[EFFECT + 1] = min(max(x[ODOMETRY_ERROR + 1], -0.05), 0.05)

    @kernel
    def twist(self, actuators: Floats, now: Floats) -> tuple[float, float]:
        speed = actuators[0] * now[EFFECT]
        return speed, -speed * math.tan(actuators[1] + now[EFFECT + 1]) / self.base_m

    @kernel
    def actuators_of(self, speed_mps: float, yaw_rate_radps: float, now: Floats) -> tuple[float, float]:
        steering = now[COMMAND + 1]
        if abs(speed_mps) > 0.02:
            steering = -math.atan(self.base_m * yaw_rate_radps / speed_mps) - now[EFFECT + 1]
        return speed_mps / now[EFFECT], steering

    @kernel
    def gain(self, actuator: int, now: Floats) -> tuple[float, float]:
        steering = now[COMMAND + 1] + now[EFFECT + 1]
        if actuator == 0:
            return now[EFFECT], -now[EFFECT] * math.tan(steering) / self.base_m
        speed = math.copysign(max(abs(now[SPEED_NOW]), 0.05), now[SPEED_NOW])
        return 0.0, -speed * (1.0 + math.tan(steering) ** 2) / self.base_m

    @kernel
    def command(self, speed_mps: float, yaw_rate_radps: float, now: Floats, actuators: Floats) -> None:
        rate, steering = onboard_drive.actuators_of(self, speed_mps, yaw_rate_radps, now)
        there, turned = now[SPEED_NOW] / now[EFFECT], now[COMMAND + 1]
        rate = min(max(rate, there - self.max_step_radps), there + self.max_step_radps)
        steering = min(max(steering, turned - self.max_steering_step_rad), turned + self.max_steering_step_rad)
        actuators[0] = min(max(rate, -self.max_rate_radps), self.max_rate_radps)
        actuators[1] = min(max(steering, -self.max_steering_rad), self.max_steering_rad)


class OnboardDrum(OnboardDrive):
    """As the robot's computer has it."""

    def __init__(self, vehicle: Vehicle, _track_width_relative: float) -> None:
        drive = self._drive = vehicle.drive
        self.lag_s, self.side_slip_rad_per_mps2 = TICK_S, 0.0
        steering_step = drive.max_steering_rate_radps * TICK_S
        self.limit = np.array([drive.max_drum_speed_radps, drive.max_steering_rad])
        self.reach = np.array([drive.max_drum_acceleration_radps2 * 2.0 * TICK_S, steering_step])
        self.lag_share, self.max_step = np.ones(2), np.array([100.0, 100.0])
        self.tolerance, self.tolerance_share = np.array([0.5, 0.1]), np.zeros(2)
        self.disobeyed = ("the drum does not turn as commanded", "the steering does not turn as commanded")
        self.figures = DrumFigures(
            drive.drum_radius_m, drive.wheelbase_m, self.limit[0], self.reach[0], self.limit[1], steering_step
        )

    def moves_mps(self, actuators: Floats) -> float:
        return abs(float(actuators[0])) * self.figures.radius_m

    def check_curvature(self, name: str, curvature_1pm: float) -> None:
        if abs(curvature_1pm) * self.figures.base_m > math.tan(self.figures.max_steering_rad) * 1.001:
            raise CommandRefused(f"{name} is too tight for the steering")

    def check_speeds(self, speed_mps: Floats, curvature_1pm: Floats, name: Callable[[int], str]) -> None:
        if speed_mps.max() > self._drive.max_speed_mps * 1.001:
            raise CommandRefused(f"{name(int(np.argmax(speed_mps)))} is too fast for the drum")

    def check_spin(self, name: str, rate_radps: float) -> None:
        raise CommandRefused(f"{name}: it cannot turn on the spot")

    def spin_acceleration_radps2(self) -> float:
        return 0.0
