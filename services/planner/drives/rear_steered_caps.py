"""A driven drum and a steered wheel behind it: κ = −tan δ / L, and the steering's rate bounds dκ/ds.

From dδ/dt = −L·v·(dκ/ds) / (1 + κ²L²): v·|dκ/ds| ≤ δ̇·(1 + κ²L²)/L.
"""

import math
from typing import NamedTuple

import numpy as np

from touchline.core.jit import kernel
from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.drives.motor_power import drawn_w
from touchline.services.planner.drives.planned_drive import ActuatorMotion, PlannedDrive
from touchline.services.planner.geometry.clothoid import Floats

# Fraction of the steering's rate that plans use, so that rounding never exceeds the limit.
RATE_SHARE = 1.0 - 1e-6
ROLLING_ON_CLAY = 0.12


class RearSteeredCaps(NamedTuple):
    """Limits of drum (m/s, m/s²) and steering (its rate by the wheelbase, 1/(m s))."""

    speed_mps: float
    acceleration_mps2: float
    bending_1pms: float

    @kernel
    def square_cap(self, _curvature: float, sharpness: float) -> float:
        """Maximum u = v² (m²/s²) at which the steering keeps up: v·|σ| ≤ δ̇/L.

        This is the condition at κ = 0, the strictest, as only the maximum curvature of a stretch is known.
        """
        square = self.speed_mps**2
        if sharpness > 0.0:
            square = min(square, (self.bending_1pms / sharpness) ** 2)
        return float(square)

    @kernel
    def gain(self, _square: float, _curvature: float, _sharpness: float, _length: float) -> float:
        """Maximum acceleration (m/s²): the drum is in the middle of its axle, so turning takes nothing of it."""
        return float(self.acceleration_mps2)

    @kernel
    def spin_lever_m(self) -> float:
        """Return infinity: a rear-steered vehicle never turns on the spot."""
        return np.inf


class PlannedRearSteered(PlannedDrive):
    """Planning model of a `RearSteeredDrive`."""

    def __init__(self, vehicle: Vehicle) -> None:
        """Take the limits from a vehicle."""
        drive = self._drive = vehicle.drive
        self.max_speed_mps = drive.max_speed_mps
        self.acceleration_mps2 = drive.max_drum_acceleration_radps2 * drive.drum_radius_m
        self.curvature_max_1pm = self.tightest_1pm = math.tan(drive.max_steering_rad) / drive.wheelbase_m
        bending_1pms = RATE_SHARE * drive.max_steering_rate_radps / drive.wheelbase_m
        self.caps = RearSteeredCaps(self.max_speed_mps, self.acceleration_mps2, bending_1pms)

    def curvature_at(self, speed_mps: float) -> float:
        """Maximum curvature (1/m), the same at every speed."""
        return self.curvature_max_1pm

    def sharpness_at(self, speed_mps: float) -> float:
        """Sharpness (1/m²) at the steering's full rate: braking takes nothing of it."""
        return float(self.caps.bending_1pms / speed_mps)

    def turns_within(self, lateral_mps2: float) -> bool:
        """Compare with the lateral acceleration v²·κ of the tightest turn."""
        return bool(lateral_mps2 >= self.max_speed_mps**2 * self.curvature_max_1pm)

    def least_s(self, length_m: float, turned_rad: float) -> float:
        """Return the time at full speed: turning does not slow the vehicle down."""
        return length_m / self.max_speed_mps

    def actuation(
        self,
        direction: Floats,
        square: Floats,
        acceleration_mps2: Floats,
        curvature_1pm: Floats,
        sharpness_1pm2: Floats,
    ) -> ActuatorMotion:
        """Drum rate (rad/s), steering angle (rad), and the change of both."""
        speed, length, radius = np.sqrt(square), self._drive.wheelbase_m, self._drive.drum_radius_m
        bend = length * curvature_1pm
        steering_rate = -length * sharpness_1pm2 * speed / (1.0 + bend * bend)
        return ActuatorMotion(
            np.stack((direction * speed / radius, -np.arctan(bend))),
            np.stack((direction * acceleration_mps2 / radius, steering_rate)),
        )

    def spinning(self, rate_radps: float) -> Floats:
        """Raise an error: `can_spin` is false."""
        raise NotImplementedError("a rear-steered vehicle cannot turn on the spot")

    def power_w(self, speed_mps: Floats, yaw_rate_radps: Floats, mass_kg: Floats, step_s: float) -> Floats:
        """Power (W) drawn by the drum's motor on level clay; turning takes little and is neglected.

        Torque overcomes rolling resistance, friction and the inertia of body and drum; gear and winding lose some.
        Braking gives back at most what the other losses take.
        """
        motor, radius_m = self._drive.motor, self._drive.drum_radius_m
        rate_radps, gain_mps2 = speed_mps / radius_m, np.gradient(speed_mps, step_s)
        drag_nm = ROLLING_ON_CLAY * GRAVITY_MPS2 * mass_kg * radius_m + motor.friction_nm
        torque_nm = np.sign(rate_radps) * drag_nm + motor.viscous_nms * rate_radps
        torque_nm += (mass_kg * radius_m + motor.inertia_kgm2 / radius_m) * gain_mps2
        return np.asarray(np.maximum(drawn_w(motor, torque_nm, rate_radps), 0.0))
