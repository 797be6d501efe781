"""Differential drive: over the ground a wheel moves at v ∓ ω·b/2, with b the track; its rim is faster by the slip s.

Slip is a share of the rim speed: ground speed = ω_wheel·r·(1 − s). The two slips are the drive's states of the filter.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.onboard.computer_state import SampleBuffer
from touchline.onboard.drives.onboard_drive import OnboardDrive
from touchline.onboard.drives.slip import ENCODER_FLOOR_MPS, SLIP_LIMIT, STILL_RAD, smooth_rim, strain_slip
from touchline.onboard.filter_model import ODOMETRY_ERROR, SPEED, YAW_RATE, TickInputs
from touchline.onboard.interface import TICK_S
from touchline.onboard.tracking_state import EFFECT
from touchline.onboard.tracking_state import SPEED as SPEED_NOW
from touchline.onboard.tracking_state import YAW_RATE as YAW_RATE_NOW
from touchline.schemas.errors import CommandRefused
from touchline.schemas.vehicles import Vehicle

Floats = NDArray[np.float64]

_TRACK_FLOOR = 0.001
_LIMIT_SLACK = 1.001
_TOLERANCE_RADPS = 0.7
_TOLERANCE_SHARE = 0.4


class DifferentialFigures(NamedTuple):
    """Parameters of the drive for kernels; its kernels are documented in `onboard_drive`.

    Attributes:
        radius_m: Nominal radius of the wheels.
        track_m: Distance between the wheels.
        half_track_m: Half of that.
        max_rate_radps: Largest rate of a wheel.
        reach_radps: Largest difference between a command and the wheel's speed: a first-order motor accelerates by
            (command − speed) / lag.
        encoder_var: Variance of a rim speed (m/s)².
        track_share: Relative uncertainty of the track (1 σ).
    """

    radius_m: float
    track_m: float
    half_track_m: float
    max_rate_radps: float
    reach_radps: float
    encoder_var: float
    track_share: float

    @kernel
    def read(self, span: int, buffer: SampleBuffer, row: TickInputs) -> bool:
        """See `onboard_drive.read`: the mean rates of the wheels, and the nominal speeds of their rims."""
        still = True
        for wheel in range(2):
            turned = buffer.turned_rad[wheel]
            still = still and abs(turned) < STILL_RAD * span
            buffer.measured[wheel] = turned / (span * TICK_S)
            row.odometry[wheel] = buffer.measured[wheel] * self.radius_m
        return still

    @kernel
    def smooth(self, before: TickInputs, z: TickInputs) -> None:
        """See `onboard_drive.smooth`: the rim speeds that slip is a share of."""
        for wheel in range(2):
            smooth_rim(wheel, before, z)

    @kernel
    def strain(self, P: Floats, before: TickInputs, z: TickInputs) -> None:
        """See `onboard_drive.strain`: nothing without the accelerometer, when only the wheels measure the speed."""
        if math.isnan(z.accel_mps2):
            return
        for wheel in range(2):
            strain_slip(wheel, P, before, z)

    @kernel
    def odometry(self, x: Floats, z: TickInputs, h: Floats) -> tuple[float, float, float]:
        """See `onboard_drive.odometry`: a wheel's speed over the ground is its nominal rim speed less slip."""
        half = 0.5 * self.track_m
        left, right = z.odometry[0], z.odometry[1]
        over_left, over_right = x[SPEED] - half * x[YAW_RATE], x[SPEED] + half * x[YAW_RATE]
        h[0, SPEED], h[0, YAW_RATE], h[0, ODOMETRY_ERROR] = 1.0, -half, z.smooth[0]
        h[1, SPEED], h[1, YAW_RATE], h[1, ODOMETRY_ERROR + 1] = 1.0, half, z.smooth[1]
        y0 = left - z.smooth[0] * x[ODOMETRY_ERROR] - over_left
        y1 = right - z.smooth[1] * x[ODOMETRY_ERROR + 1] - over_right
        return y0, y1, self.encoder_var + (self.track_share * half * x[YAW_RATE]) ** 2

    @kernel
    def effective(self, x: Floats, now: Floats) -> None:
        """See `onboard_drive.effective`: the radii of the wheels, slip included [m]."""
        for wheel in range(2):
            slip = min(max(x[ODOMETRY_ERROR + wheel], -SLIP_LIMIT), SLIP_LIMIT)
            now[EFFECT + wheel] = self.radius_m * (1.0 - slip)

    @kernel
    def twist(self, actuators: Floats, now: Floats) -> tuple[float, float]:
        """See `onboard_drive.twist`: v = (v_left + v_right)/2, ω = (v_right − v_left)/b."""
        left, right = actuators[0] * now[EFFECT], actuators[1] * now[EFFECT + 1]
        return 0.5 * (left + right), (right - left) / self.track_m

    @kernel
    def actuators_of(self, speed_mps: float, yaw_rate_radps: float, now: Floats) -> tuple[float, float]:
        """See `onboard_drive.actuators_of`: a wheel's rate is the ground speed beneath it over its effective radius."""
        apart = self.half_track_m * yaw_rate_radps
        return (speed_mps - apart) / now[EFFECT], (speed_mps + apart) / now[EFFECT + 1]

    @kernel
    def gain(self, actuator: int, now: Floats) -> tuple[float, float]:
        """See `onboard_drive.gain`: half the radius, and that over half the track, negative for the left wheel."""
        speed = 0.5 * now[EFFECT + actuator]
        return speed, (2 * actuator - 1) * speed / self.half_track_m

    @kernel
    def command(self, speed_mps: float, yaw_rate_radps: float, now: Floats, actuators: Floats) -> None:
        """See `onboard_drive.command`: excess speed is scaled down, keeping the curvature; excess change is clipped."""
        half, fastest, reach = self.half_track_m, self.max_rate_radps, self.reach_radps
        left = (speed_mps - half * yaw_rate_radps) / now[EFFECT]
        right = (speed_mps + half * yaw_rate_radps) / now[EFFECT + 1]
        faster = max(abs(left), abs(right))
        if faster > fastest:
            left, right = left * fastest / faster, right * fastest / faster
        left_now = (now[SPEED_NOW] - half * now[YAW_RATE_NOW]) / now[EFFECT]
        right_now = (now[SPEED_NOW] + half * now[YAW_RATE_NOW]) / now[EFFECT + 1]
        left = min(max(left, left_now - reach), left_now + reach)
        right = min(max(right, right_now - reach), right_now + reach)
        actuators[0], actuators[1] = min(max(left, -fastest), fastest), min(max(right, -fastest), fastest)


class OnboardDifferential(OnboardDrive):
    """The onboard side of a `DifferentialDrive`."""

    def __init__(self, vehicle: Vehicle, track_width_relative: float) -> None:
        """Take the parameters of a vehicle's drive; see the base."""
        drive = self._drive = vehicle.drive
        self.lag_s = drive.motor_time_constant_s
        lag_s, tick_rad = max(self.lag_s, TICK_S), 2.0 * math.pi / drive.encoder_ticks_per_revolution
        reach_radps = drive.max_wheel_acceleration_radps2 * lag_s
        self.figures = DifferentialFigures(
            drive.wheel_radius_m,
            drive.track_width_m,
            drive.half_track_m,
            drive.max_wheel_speed_radps,
            reach_radps,
            (tick_rad * drive.wheel_radius_m / TICK_S) ** 2 / 6.0 + ENCODER_FLOOR_MPS**2,
            max(track_width_relative, _TRACK_FLOOR),
        )
        self.limit, self.reach = np.full(2, drive.max_wheel_speed_radps), np.full(2, reach_radps)
        self.driven_share = 1.0 - drive.caster_load_share
        self.lag_share = np.full(2, 1.0 - math.exp(-TICK_S / lag_s))
        self.max_step = np.full(2, drive.max_wheel_acceleration_radps2 * TICK_S)
        self.tolerance = np.full(2, _TOLERANCE_RADPS)
        self.tolerance_share = np.full(2, _TOLERANCE_SHARE)
        self.disobeyed = tuple(f"the {wheel.name} wheel does not turn as commanded" for wheel in drive.actuators)
        self.side_slip_rad_per_mps2 = drive.side_slip_rad_per_mps2

    def moves_mps(self, actuators: Floats) -> float:
        """Return the speed of the faster rim [m/s]."""
        return float(np.abs(actuators).max() * self.figures.radius_m)

    def check_curvature(self, name: str, curvature_1pm: float) -> None:
        """See the base: refuse a curvature at which the inner wheel would have to run backward."""
        half_m = self.figures.half_track_m
        if abs(curvature_1pm) * half_m > 1.0:
            raise CommandRefused(
                f"{name} has a radius of {abs(1 / curvature_1pm):.3f} m, less than half the track "
                f"({half_m:.3f} m): the inner wheel would have to run backward"
            )

    def check_speeds(self, speed_mps: Floats, curvature_1pm: Floats, name: Callable[[int], str]) -> None:
        """See the base: refuse speeds at which the outer wheel would exceed its limit."""
        rim_mps = speed_mps * (1.0 + np.abs(curvature_1pm) * self.figures.half_track_m)
        worst = int(np.argmax(rim_mps))
        if rim_mps[worst] > self._drive.max_speed_mps * _LIMIT_SLACK:
            raise CommandRefused(
                f"{name(worst)}: {speed_mps[worst]:.2f} m/s at curvature {curvature_1pm[worst]:.3f} 1/m "
                f"{self._needs(rim_mps[worst])}"
            )

    def check_spin(self, name: str, rate_radps: float) -> None:
        """See the base: refuse a rate at which both wheels would exceed their limit."""
        rim_mps = rate_radps * self.figures.half_track_m
        if rim_mps > self._drive.max_speed_mps * _LIMIT_SLACK:
            raise CommandRefused(f"{name}: turning on the spot at {rate_radps:.2f} rad/s {self._needs(rim_mps)}")

    def _needs(self, rim_mps: float) -> str:
        wheel_radps, limit_radps = rim_mps / self.figures.radius_m, self.figures.max_rate_radps
        return f"needs a wheel speed of {wheel_radps:.2f} rad/s; the limit is {limit_radps:.2f} rad/s"

    def spin_acceleration_radps2(self) -> float:
        """Return the yaw acceleration by the planned acceleration at the lever with which plans turn."""
        return float(self._drive.max_acceleration_mps2 / self._drive.spin_lever_m)
