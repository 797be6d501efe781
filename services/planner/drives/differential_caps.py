"""Two driven wheels: a rim runs at v(1 ± κr) and accelerates with a(1 ± κr) ± v²σr, where r is half the track."""

from typing import NamedTuple

import numpy as np

from touchline.core.jit import kernel
from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.drives.motor_power import drawn_w
from touchline.services.planner.drives.planned_drive import ActuatorMotion, PlannedDrive
from touchline.services.planner.geometry.clothoid import Floats

# Fraction of the wheels' acceleration that plans use, so that rounding never exceeds the limit.
RIM_SHARE = 1.0 - 1e-6
# Maximum curvature as a fraction of 1/r, at which the inner wheel stands still.
CURVATURE_SHARE = 0.98
# Fraction of the wheels' acceleration that turns at constant speed take.
TURNING_SHARE = 0.8
ROLLING_ON_GRASS = 0.06


class DifferentialCaps(NamedTuple):
    """Limits of the rims (m/s, m/s²), half the track (m), the yaw rate's limit (rad/s), and a spin's lever (m)."""

    rim_speed_mps: float
    rim_acceleration_mps2: float
    half_track_m: float
    yaw_rate_radps: float
    lever_m: float

    @kernel
    def square_cap(self, curvature: float, sharpness: float) -> float:
        """Maximum u = v² (m²/s²): the outer rim runs at v(1 + |κ|r) and, at constant speed, gains uσr; |κ|v is ω.

        Args:
            curvature: Maximum |curvature| of the stretch (1/m).
            sharpness: Its |sharpness| (1/m²).
        """
        square = (self.rim_speed_mps / (1.0 + curvature * self.half_track_m)) ** 2
        if curvature > 0.0:
            square = min(square, (self.yaw_rate_radps / curvature) ** 2)
        if sharpness > 0.0:
            square = min(square, self.rim_acceleration_mps2 / (sharpness * self.half_track_m))
        return float(square)

    @kernel
    def gain(self, square: float, curvature: float, sharpness: float, length: float) -> float:
        """Maximum acceleration (m/s²) with which both rims keep their limits throughout a stretch; may be negative.

        A rim gains a(1 ± κr) ± uσr. With u and κ linear in arc length that is linear, too, so the limit holds
        throughout if it holds at both ends. At the end u has grown by 2·a·length, which is why κ is taken there with
        three times its change.

        Args:
            square: u at the beginning of the stretch (m²/s²).
            curvature: Signed curvature at its beginning (1/m).
            sharpness: Signed sharpness, constant (1/m²).
            length: Length of the stretch (m).
        """
        most, r, rim = np.inf, self.half_track_m, self.rim_acceleration_mps2
        for side in (-1.0, 1.0):
            turning = side * square * sharpness * r
            for reach in (curvature, curvature + 3.0 * sharpness * length):
                share = 1.0 + side * reach * r
                if share > 0.0:
                    most = min(most, (rim - turning) / share)
                elif share < 0.0:
                    most = min(most, (-rim - turning) / share)
        return float(most)

    @kernel
    def spin_lever_m(self) -> float:
        """Lever of a turn on the spot (m); see `DifferentialDrive.spin_lever_m`."""
        return float(self.lever_m)


class PlannedDifferential(PlannedDrive):
    """Planning model of a `DifferentialDrive`."""

    def __init__(self, vehicle: Vehicle) -> None:
        """Take the limits from a vehicle."""
        drive = self._drive = vehicle.drive
        self._gyration_m = vehicle.body.radius_of_gyration_m
        wheel_acceleration = min(drive.planned_wheel_acceleration_radps2, drive.max_wheel_acceleration_radps2)
        half_track, self.max_speed_mps = drive.half_track_m, drive.max_speed_mps
        self.acceleration_mps2 = RIM_SHARE * wheel_acceleration * drive.wheel_radius_m
        yaw_rate = drive.max_yaw_rate_radps
        self.caps = DifferentialCaps(
            self.max_speed_mps, self.acceleration_mps2, half_track, yaw_rate, drive.spin_lever_m
        )
        # In a tighter turn the inner wheel would run backward, in the middle of a forward path.
        self.curvature_max_1pm, self.tightest_1pm = 1.0 / half_track, CURVATURE_SHARE / half_track

    def curvature_at(self, speed_mps: float) -> float:
        """Curvature (1/m) at which the outer rim reaches its maximum speed, or the body its maximum yaw rate."""
        rim = (self.max_speed_mps - speed_mps) / (speed_mps * self.caps.half_track_m)
        return float(min(rim, self.caps.yaw_rate_radps / speed_mps))

    def sharpness_at(self, speed_mps: float) -> float:
        """Sharpness (1/m²) at which turning takes `TURNING_SHARE` of the rims' acceleration."""
        return float(TURNING_SHARE * self.acceleration_mps2 / (self.caps.half_track_m * speed_mps**2))

    def turns_within(self, lateral_mps2: float) -> bool:
        """Compare with the maximum: with the outer rim at v_w, v(v_w - v)/r is at most v_w²/(4r)."""
        return bool(lateral_mps2 >= self.max_speed_mps**2 / (4.0 * self.caps.half_track_m))

    def least_s(self, length_m: float, turned_rad: float) -> float:
        """Return (L + r·θ) / v_w: with the outer rim at v_w a robot drives v = v_w / (1 + |κ|·r)."""
        return float((length_m + self.caps.half_track_m * turned_rad) / self.max_speed_mps)

    def actuation(
        self,
        direction: Floats,
        square: Floats,
        acceleration_mps2: Floats,
        curvature_1pm: Floats,
        sharpness_1pm2: Floats,
    ) -> ActuatorMotion:
        """Rate (rad/s) and acceleration (rad/s²) of the left and the right wheel."""
        speed, gain = np.sqrt(square), acceleration_mps2
        reach, turning = self.caps.half_track_m * curvature_1pm, self.caps.half_track_m * square * sharpness_1pm2
        rims = direction * np.stack((speed * (1.0 - reach), speed * (1.0 + reach)))
        gains = direction * np.stack((gain * (1.0 - reach) - turning, gain * (1.0 + reach) + turning))
        return ActuatorMotion(rims / self._drive.wheel_radius_m, gains / self._drive.wheel_radius_m)

    def spinning(self, rate_radps: float) -> Floats:
        """Opposite rates (rad/s) of the two wheels."""
        sides = np.array([[-1.0], [1.0]]) * self.caps.half_track_m / self._drive.wheel_radius_m
        return np.asarray(sides * rate_radps)

    def power_w(self, speed_mps: Floats, yaw_rate_radps: Floats, mass_kg: Floats, step_s: float) -> Floats:
        """Power (W) drawn by both motors on level, dry grass.

        Torque overcomes rolling resistance, the drives' own friction and the inertia of body and wheels, in turns, too;
        gears and windings lose some. Braking gives back at most what the other losses take.
        """
        motor, radius_m, half_m = self._drive.motor, self._drive.wheel_radius_m, self.caps.half_track_m
        ahead_n = 0.5 * mass_kg * np.gradient(speed_mps, step_s)
        turning_n = mass_kg * self._gyration_m**2 * np.gradient(yaw_rate_radps, step_s) / (2.0 * half_m)
        total_w = np.zeros(len(speed_mps))
        for side in (-1.0, 1.0):
            rate_radps = (speed_mps + side * half_m * yaw_rate_radps) / radius_m
            drag_nm = 0.5 * ROLLING_ON_GRASS * GRAVITY_MPS2 * mass_kg * radius_m + motor.friction_nm
            torque_nm = np.sign(rate_radps) * drag_nm + motor.viscous_nms * rate_radps
            torque_nm += radius_m * (ahead_n + side * turning_n) + motor.inertia_kgm2 * np.gradient(rate_radps, step_s)
            total_w += drawn_w(motor, torque_nm, rate_radps)
        return np.maximum(total_w, 0.0)
