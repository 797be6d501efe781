"""A driven drum and a steered wheel behind it: v = ω_d·r·(1 − s₀), and ω + v·tan(δ + s₁)/L = 0.

The drive's two states of the filter are the drum's slip s₀ and the steering offset s₁, by which the wheel points
further to the left than its encoder reads: its adjustment and the side slip of the tyre.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.onboard.computer_state import SampleBuffer
from touchline.onboard.drives import onboard_drive
from touchline.onboard.drives.onboard_drive import Aim, LastingError, OnboardDrive
from touchline.onboard.drives.slip import (
    ENCODER_FLOOR_MPS,
    JUMP_TICKS,
    SLIP_LIMIT,
    STILL_RAD,
    smooth_rim,
    strain_slip,
)
from touchline.onboard.filter_model import ODOMETRY_ERROR, SPEED, YAW_RATE, TickInputs
from touchline.onboard.interface import TICK_S
from touchline.onboard.tracking_state import COMMAND, EFFECT, REFERENCE_SPEED
from touchline.onboard.tracking_state import SPEED as SPEED_NOW
from touchline.schemas.errors import CommandRefused
from touchline.schemas.vehicles import Vehicle

Floats = NDArray[np.float64]

STANDING_MPS: Final = 0.02
"""Speed below which the steering is held: its angle would be the ratio of two numbers near 0."""
_GAIN_FLOOR_MPS = 0.05
_OFFSET_LIMIT_RAD = 0.1
_OFFSET_TAU_S = 6000.0  # with an σ of 1°: 0.3 mrad in a second, 2.5 mrad in a minute
_CURVE_SLIP = 0.01  # rad of side slip per rad of unusual steering, 1 σ
_CURVE_S = 2.0  # time constant of the usual steering angle
_CURVE_SHARE = TICK_S / _CURVE_S
_JUMP_VAR = 0.05**2
_JUMP_FROM_MPS = 0.2
_LEANING = 2.2  # σ, over half a second; without a blow at most 1.6 in more than an hour of lanes and turns
_SLACK = 1.001
_DRUM_TOLERANCE_RADPS, _DRUM_TOLERANCE_SHARE = 0.25, 0.2
_STEERING_TOLERANCE_RAD = 0.035
_STEERING_MOVE_RAD = 0.3
_HORIZON_TICKS: Final = (2, 4, 6, 8, 10, 12, 14, 18, 22, 28, 34, 42)
"""2 s in all: with half of that the horizon ends before the steering has swung out and back, and the MPC weaves about
its path."""
_AIM: Final = Aim(lookahead_s=1.2, lookahead_min_m=1.0, lateral_integral_1pm2s=0.05)


class RearSteeredFigures(NamedTuple):
    """Parameters of the drive for kernels.

    Attributes:
        radius_m: Nominal radius of the drum.
        base_m: Wheelbase.
        max_rate_radps: Largest rate of the drum.
        reach_radps: Largest difference between the drum's command and its rate.
        stop_rad: Largest steering angle.
        step_rad: Largest change of the steering command in a tick.
        encoder_var: Variance of the drum's speed (m/s)².
        angle_var: Variance of the steering angle, rad².
        base_share: Relative uncertainty of the wheelbase (1 σ).
    """

    radius_m: float
    base_m: float
    max_rate_radps: float
    reach_radps: float
    stop_rad: float
    step_rad: float
    encoder_var: float
    angle_var: float
    base_share: float

    @kernel
    def read(self, span: int, buffer: SampleBuffer, row: TickInputs) -> bool:
        """See `onboard_drive.read`: mean rate and steering angle; as odometry nominal rim speed and mean angle.

        A robot that only steers counts as standing.
        """
        drum, steered = buffer.turned_rad[0], buffer.turned_rad[1]
        buffer.measured[0] = drum / (span * TICK_S)
        buffer.measured[1] = buffer.angles_rad[1]
        row.odometry[0] = buffer.measured[0] * self.radius_m
        row.odometry[1] = buffer.angles_rad[1] - 0.5 * steered
        return bool(abs(drum) < STILL_RAD * span)

    @kernel
    def smooth(self, before: TickInputs, z: TickInputs) -> None:
        """See `onboard_drive.smooth`: the drum's rim speed, and the usual steering angle of the last seconds."""
        smooth_rim(0, before, z)
        usual, angle = before.smooth[1], z.odometry[1]
        if math.isnan(usual):
            usual = angle
        elif not math.isnan(angle):
            usual += _CURVE_SHARE * (angle - usual)
        z.smooth[1] = usual

    @kernel
    def strain(self, P: Floats, before: TickInputs, z: TickInputs) -> None:
        """See `onboard_drive.strain`: the drum slips as a wheel does; the tyre's side slip changes with the steering.

        Readings that are rejected again and again indicate an offset that jumped because somebody hit the wheel. So do
        readings that all deviate to one side: a robot that sets off after the blow is slow, and none of them is an
        outlier. Without the accelerometer only the drum measures the speed, and nothing is added.
        """
        if math.isnan(z.accel_mps2):
            return
        strain_slip(0, P, before, z)
        i = ODOMETRY_ERROR + 1
        unusual = _CURVE_SLIP * (z.odometry[1] - z.smooth[1])
        if not math.isnan(unusual):
            P[i, i] += 2.0 * _CURVE_SHARE * unusual * unusual
        refused = z.refused_ticks >= JUMP_TICKS and abs(z.smooth[0]) > _JUMP_FROM_MPS
        if refused or abs(z.lean[1]) > _LEANING:
            P[i, i], z.lean[1] = max(P[i, i], _JUMP_VAR), 0.0

    @kernel
    def odometry(self, x: Floats, z: TickInputs, h: Floats) -> tuple[float, float, float]:
        """See `onboard_drive.odometry`: the drum's speed less slip; and the wheel's contact moves along the wheel only.

        The second innovation is −v·tan(δ + s₁) − L·ω: 0 if it does. The variance, the same for both, is the sum of all
        uncertainties.
        """
        angle = z.odometry[1] + x[ODOMETRY_ERROR + 1]
        tan = math.tan(angle)
        bent = 1.0 + tan * tan
        h[0, SPEED], h[0, ODOMETRY_ERROR] = 1.0, z.smooth[0]
        h[1, SPEED], h[1, YAW_RATE], h[1, ODOMETRY_ERROR + 1] = tan, self.base_m, x[SPEED] * bent
        y0 = z.odometry[0] - z.smooth[0] * x[ODOMETRY_ERROR] - x[SPEED]
        y1 = -x[SPEED] * tan - self.base_m * x[YAW_RATE]
        unsure = self.base_share * self.base_m * x[YAW_RATE]
        return y0, y1, self.encoder_var + self.angle_var * (x[SPEED] * bent) ** 2 + unsure * unsure

    @kernel
    def effective(self, x: Floats, now: Floats) -> None:
        """See `onboard_drive.effective`: the drum's radius, slip included [m], and the steering's offset [rad]."""
        slip = min(max(x[ODOMETRY_ERROR], -SLIP_LIMIT), SLIP_LIMIT)
        now[EFFECT] = self.radius_m * (1.0 - slip)
        now[EFFECT + 1] = min(max(x[ODOMETRY_ERROR + 1], -_OFFSET_LIMIT_RAD), _OFFSET_LIMIT_RAD)

    @kernel
    def twist(self, actuators: Floats, now: Floats) -> tuple[float, float]:
        """See `onboard_drive.twist`: v = ω_d·r·(1 − s₀), ω = −v·tan(δ + s₁)/L.

        The kinematic single-track model (R. Rajamani, "Vehicle Dynamics and Control", 2nd ed., ch. 2), steered at
        the rear alone and seen from the axle in front.
        """
        speed = actuators[0] * now[EFFECT]
        return speed, -speed * math.tan(actuators[1] + now[EFFECT + 1]) / self.base_m

    @kernel
    def actuators_of(self, speed_mps: float, yaw_rate_radps: float, now: Floats) -> tuple[float, float]:
        """See `onboard_drive.actuators_of`: at speeds too low to determine its angle, the steering is held."""
        steering = now[COMMAND + 1]
        if abs(speed_mps) > STANDING_MPS:
            steering = -math.atan(self.base_m * yaw_rate_radps / speed_mps) - now[EFFECT + 1]
        return speed_mps / now[EFFECT], steering

    @kernel
    def gain(self, actuator: int, now: Floats) -> tuple[float, float]:
        """See `onboard_drive.gain`: the drum's at the present steering angle, the steering's at the present speed.

        At standstill, and while the robot still rolls against its reference, the steering's is that of a low speed.
        """
        tan = math.tan(now[COMMAND + 1] + now[EFFECT + 1])
        if actuator == 0:
            return now[EFFECT], -now[EFFECT] * tan / self.base_m
        sense = math.copysign(1.0, now[REFERENCE_SPEED])
        speed = sense * max(sense * now[SPEED_NOW], _GAIN_FLOOR_MPS)
        return 0.0, -speed * (1.0 + tan * tan) / self.base_m

    @kernel
    def command(self, speed_mps: float, yaw_rate_radps: float, now: Floats, actuators: Floats) -> None:
        """See `onboard_drive.command`: changes too fast for the drum or the steering are clipped.

        A command beyond the angle that the steering reaches in a tick would only wait.
        """
        rate, steering = onboard_drive.actuators_of(self, speed_mps, yaw_rate_radps, now)
        there, held = now[SPEED_NOW] / now[EFFECT], now[COMMAND + 1]
        rate = min(max(rate, there - self.reach_radps), there + self.reach_radps)
        steering = min(max(steering, held - self.step_rad), held + self.step_rad)
        actuators[0] = min(max(rate, -self.max_rate_radps), self.max_rate_radps)
        actuators[1] = min(max(steering, -self.stop_rad), self.stop_rad)


class OnboardRearSteered(OnboardDrive):
    """The onboard side of a `RearSteeredDrive`."""

    def __init__(self, vehicle: Vehicle, track_width_relative: float) -> None:
        """Take the parameters of a vehicle's drive; see the base."""
        drive = self._drive = vehicle.drive
        self.lag_s, self.driven_share = drive.steering_time_constant_s, drive.drum_load_share
        self.side_slip_rad_per_mps2 = drive.side_slip_rad_per_mps2
        self.lasting_errors = (None, LastingError(max(drive.steering_offset_rad, 1e-4), _OFFSET_TAU_S))
        self.move_scale, self.aim, self.horizon_ticks = (8.0, _STEERING_MOVE_RAD), _AIM, _HORIZON_TICKS
        self.one_way, self.slip_hides_arm = (True, False), True
        lags_s = np.maximum([drive.drum_time_constant_s, drive.steering_time_constant_s], TICK_S)
        rates = np.array([drive.max_drum_acceleration_radps2, drive.steering_rate_limit_radps])
        self.limit = np.array([drive.max_drum_speed_radps, drive.steering_stop_rad])
        self.reach, self.max_step, self.lag_share = rates * lags_s, rates * TICK_S, -np.expm1(-TICK_S / lags_s)
        self.tolerance = np.array([_DRUM_TOLERANCE_RADPS, _STEERING_TOLERANCE_RAD])
        self.tolerance_share = np.array([_DRUM_TOLERANCE_SHARE, 0.0])
        self.disobeyed = tuple(f"the {each.name} does not turn as commanded" for each in drive.actuators)
        count_m = drive.actuators[0].encoder_rad * drive.drum_radius_m
        self.figures = RearSteeredFigures(
            drive.drum_radius_m,
            drive.wheelbase_m,
            drive.max_drum_speed_radps,
            float(self.reach[0]),
            drive.steering_stop_rad,
            float(self.max_step[1]),
            (count_m / TICK_S) ** 2 / 6.0 + ENCODER_FLOOR_MPS**2,
            drive.steering_encoder_rad**2 / 12.0,
            track_width_relative,
        )

    def resting(self, actuators: tuple[float, ...]) -> tuple[float, ...]:
        """See the base: stop the drum and hold the steering, which would have to turn back afterwards."""
        return 0.0, actuators[1]

    def moves_mps(self, actuators: Floats) -> float:
        """Return the rim speed of the drum [m/s]."""
        return float(abs(actuators[0]) * self.figures.radius_m)

    def check_curvature(self, name: str, curvature_1pm: float) -> None:
        """See the base: refuse a curvature that needs more than the largest steering angle."""
        needed_rad = math.atan(abs(curvature_1pm) * self.figures.base_m)
        if needed_rad > self._drive.max_steering_rad * _SLACK:
            raise CommandRefused(
                f"{name} has a radius of {abs(1 / curvature_1pm):.3f} m, which needs a steering angle of "
                f"{needed_rad:.3f} rad; the limit is {self._drive.max_steering_rad:.3f} rad"
            )

    def check_speeds(self, speed_mps: Floats, curvature_1pm: Floats, name: Callable[[int], str]) -> None:
        """See the base: refuse speeds above the drum's limit, which is the same in turns."""
        worst = int(np.argmax(speed_mps))
        if speed_mps[worst] > self._drive.max_speed_mps * _SLACK:
            raise CommandRefused(
                f"{name(worst)}: {speed_mps[worst]:.2f} m/s, the limit is {self._drive.max_speed_mps:.2f} m/s"
            )

    def check_spin(self, name: str, rate_radps: float) -> None:
        """See the base: always refuse."""
        raise CommandRefused(f"{name}: a rear-steered vehicle cannot turn on the spot")

    def spin_acceleration_radps2(self) -> float:
        """Return 0: the vehicle cannot turn on the spot."""
        return 0.0
