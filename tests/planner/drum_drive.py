"""A drive of somebody else: a driven drum in front, a steered wheel behind; related to nothing that is shipped.

The frame is the middle of the drum's axle: κ = -tan δ / L, and the steering's rate bounds dκ/ds, the faster the more.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.schemas.plugins import DRIVES, KindParts
from touchline.schemas.vehicles import Actuator, DriveSpec, GroundContact, Vehicle
from touchline.services.planner.drives.planned_drive import ActuatorMotion, PlannedDrive

Floats = NDArray[np.float64]
ROLLING = 0.05


class DrumDrive(DriveSpec):
    """As a vehicle's file has it."""

    kind: Literal["drum"] = "drum"
    drum_radius_m: float = 0.4
    wheelbase_m: float = 1.0
    max_steering_rad: float = 0.6
    max_steering_rate_radps: float = 0.5
    max_drum_speed_radps: float = 4.0
    max_drum_acceleration_radps2: float = 2.0
    default_kappa_max_1pm: float = 0.5
    default_sigma_max_1pm2: float = 0.3

    @property
    def max_speed_mps(self) -> float:
        return self.drum_radius_m * self.max_drum_speed_radps

    @property
    def actuators(self) -> tuple[Actuator, ...]:
        drum = self.max_drum_speed_radps, self.max_drum_acceleration_radps2
        steering = self.max_steering_rad, self.max_steering_rate_radps
        return (
            Actuator("drum", "wheel speed", "rad/s", "wheel acceleration", *drum, "drum", 1e-4),
            Actuator("steering", "steering angle", "rad", "steering rate", *steering, "fork", 1e-4),
        )

    @property
    def contacts(self) -> tuple[GroundContact, ...]:
        drum = (GroundContact(0.0, y, 0.02, self.drum_radius_m) for y in (0.3, -0.3))
        return *drum, GroundContact(-self.wheelbase_m, 0.0, 0.05, 0.15)


class DrumCaps(NamedTuple):
    """Figures of it for kernels."""

    acceleration_mps2: float
    steering_1pms: float
    """Rate of steering by wheelbase, 1/(m s)."""

    @kernel
    def square_cap(self, _curvature: float, sharpness: float) -> float:
        return (self.steering_1pms / sharpness) ** 2 if sharpness > 0.0 else np.inf

    @kernel
    def gain(self, _square: float, _curvature: float, _sharpness: float, _length: float) -> float:
        return float(self.acceleration_mps2)

    @kernel
    def spin_lever_m(self) -> float:
        return np.inf


class PlannedDrum(PlannedDrive):
    """The planner's side."""

    def __init__(self, vehicle: Vehicle) -> None:
        drive = self._drive = vehicle.drive
        self.max_speed_mps = drive.max_speed_mps
        self.acceleration_mps2 = drive.drum_radius_m * drive.max_drum_acceleration_radps2
        self.curvature_max_1pm = self.tightest_1pm = math.tan(drive.max_steering_rad) / drive.wheelbase_m
        self.caps = DrumCaps(self.acceleration_mps2, drive.max_steering_rate_radps / drive.wheelbase_m)

    def curvature_at(self, _speed_mps: float) -> float:
        return self.curvature_max_1pm

    def sharpness_at(self, speed_mps: float) -> float:
        return self.caps.steering_1pms / speed_mps

    def turns_within(self, lateral_mps2: float) -> bool:
        return lateral_mps2 >= self.max_speed_mps**2 * self.curvature_max_1pm

    def least_s(self, length_m: float, _turned_rad: float) -> float:
        return length_m / self.max_speed_mps

    def actuation(
        self,
        direction: Floats,
        square: Floats,
        acceleration_mps2: Floats,
        curvature_1pm: Floats,
        sharpness_1pm2: Floats,
    ) -> ActuatorMotion:
        speed, length, radius = np.sqrt(square), self._drive.wheelbase_m, self._drive.drum_radius_m
        steering = -np.arctan(length * curvature_1pm)
        rate = -length * sharpness_1pm2 * speed / (1.0 + (length * curvature_1pm) ** 2)
        drum = direction * speed / radius, direction * acceleration_mps2 / radius
        return ActuatorMotion(np.stack((drum[0], steering)), np.stack((drum[1], rate)))

    def spinning(self, _rate_radps: float) -> Floats:
        raise AssertionError("it never turns on the spot")

    def power_w(self, speed_mps: Floats, _yaw_rate_radps: Floats, mass_kg: Floats, step_s: float) -> Floats:
        force_n = mass_kg * (np.gradient(speed_mps, step_s) + ROLLING * GRAVITY_MPS2)
        return np.maximum(force_n * np.abs(speed_mps), 0.0)


@contextmanager
def registered() -> Iterator[None]:
    """With the kind `drum` among the drives."""
    DRIVES.register("drum", "a driven drum and a steered wheel", KindParts(DrumDrive, PlannedDrum))
    try:
        yield
    finally:
        DRIVES.forget("drum")
