"""The planner's side: both wheels of a side run alike, as one of two does that are as far apart as it turns about."""

import math

import numpy as np
from numpy.typing import NDArray

from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.drives.differential_caps import DifferentialCaps, PlannedDifferential
from touchline.services.planner.drives.planned_drive import ActuatorMotion

Floats = NDArray[np.float64]
ROLLING = 0.06
TIGHTEST_1PM = 1.2
"""In tighter turns it would be dragged across more than it knows of."""


class PlannedSkidSteer(PlannedDifferential):
    def __init__(self, vehicle: Vehicle) -> None:
        drive = self._drive = vehicle.drive
        half_m, self.max_speed_mps = drive.half_turning_m, drive.max_speed_mps
        self.acceleration_mps2 = drive.wheel_radius_m * drive.planned_wheel_acceleration_radps2 * (1.0 - 1e-6)
        self.caps = DifferentialCaps(self.max_speed_mps, self.acceleration_mps2, half_m, math.inf, half_m)
        self.curvature_max_1pm = self.tightest_1pm = TIGHTEST_1PM

    def actuation(self, *path: Floats) -> ActuatorMotion:
        """The left and the right wheel in front, and the same behind."""
        value, rate = super().actuation(*path)
        return ActuatorMotion(np.concatenate((value, value)), np.concatenate((rate, rate)))

    def spinning(self, rate_radps: float) -> Floats:
        return np.tile(super().spinning(rate_radps), (2, 1))

    def power_w(self, speed_mps: Floats, yaw_rate_radps: Floats, mass_kg: Floats, step_s: float) -> Floats:
        """Rolling, speeding up, and in turns the drag across: half of the weight's grip, at the lever of a wheel."""
        ahead_n = mass_kg * (np.gradient(speed_mps, step_s) + ROLLING * GRAVITY_MPS2)
        dragged_w = 0.3 * mass_kg * GRAVITY_MPS2 * 0.5 * self._drive.wheelbase_m * np.abs(yaw_rate_radps)
        return np.asarray(np.maximum(ahead_n * np.abs(speed_mps), 0.0) + dragged_w)
