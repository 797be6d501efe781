"""Limits of a plan: those of the vehicle, and those that the options ask for within them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.drives.caps import Caps, square_caps
from touchline.services.planner.drives.planned_drive import PlannedDrive, planned_drive
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.method_traits import MethodTraits, method_as

# Beyond these a plan would be nonsense (turns of 100 m radius, puddles of paint) rather than merely poor.
CURVATURE_MIN_1PM = 0.01
SHARPNESS_RANGE_1PM2 = (0.001, 1000.0)
SPEED_MIN_MPS = 0.05
# Speeds of the turns on offer, the slower the tighter.
TURN_SPEEDS_MPS = (0.6, 0.8, 1.0, 1.25, 1.5, 1.8)


@dataclass(frozen=True)
class Limits:
    """Maximum curvature (1/m), sharpness (1/m²), speeds (m/s) and accelerations (m/s²), and the drive with its own."""

    curvature_max_1pm: float
    sharpness_max_1pm2: float
    paint_speed_mps: float
    transit_speed_mps: float
    acceleration_mps2: float
    lateral_mps2: float
    drive: PlannedDrive

    @classmethod
    def of(cls, vehicle: Vehicle, options: PlanOptions) -> "Limits":
        """Compute the limits for `options`, where 0 means the vehicle's default.

        Transit is at least as fast as paint; if only a lower transit speed is asked for, paint is as slow.

        Raises:
            PlanningError: An option is not finite, not positive, or beyond what the vehicle can do; or paint shall be
                faster than transit; or there is no such method.
        """
        drive = planned_drive(vehicle)
        curvatures = (CURVATURE_MIN_1PM, drive.curvature_max_1pm)
        tightest, sharpest = vehicle.drive.default_kappa_max_1pm, vehicle.drive.default_sigma_max_1pm2
        # A method with one turn for all speeds takes the vehicle's data, the others the drive's dynamics.
        if method_as(MethodTraits, options).by_dynamics:
            tightest = drive.tightest_1pm
            sharpest = min(drive.sharpness_at(TURN_SPEEDS_MPS[0]), SHARPNESS_RANGE_1PM2[1])
        curvature = _option("kappa_max_1pm", options.kappa_max_1pm, tightest, *curvatures, "1/m")
        sharpness = _option("sigma_max_1pm2", options.sigma_max_1pm2, sharpest, *SHARPNESS_RANGE_1PM2, "1/m²")
        speeds = (SPEED_MIN_MPS, drive.max_speed_mps, "m/s")
        paint = _option("paint_speed_mps", options.paint_speed_mps, vehicle.tool.work_speed_mps, *speeds)
        transit = _option("transit_speed_mps", options.transit_speed_mps, vehicle.drive.transit_speed_mps, *speeds)
        if options.transit_speed_mps == 0.0:
            transit = max(transit, paint)
        elif options.paint_speed_mps > transit:
            raise PlanningError(
                "",
                f"has paint_speed_mps = {paint:g} above transit_speed_mps = {transit:g}",
                "give a transit speed of at least the paint speed, or 0 for one that suits",
            )
        paint = min(paint, transit)
        if not vehicle.tool.steady_speed:
            transit = paint  # the tool works everywhere, so nothing is driven faster
        acceleration = min(vehicle.drive.max_acceleration_mps2, drive.acceleration_mps2)
        return cls(
            curvature, sharpness, paint, transit, acceleration, vehicle.drive.max_lateral_acceleration_mps2, drive
        )

    @cached_property
    def caps(self) -> Caps:
        """Limits in the form that kernels take."""
        return Caps(self.transit_speed_mps, self.acceleration_mps2, self.lateral_mps2, self.drive.caps)

    def square_cap(self, curvature_1pm: Floats, sharpness_1pm2: Floats) -> Floats:
        """Maximum v² (m²/s²) at |curvature| and |sharpness|, both (n,)."""
        return np.asarray(square_caps(curvature_1pm, sharpness_1pm2, self.caps))

    @property
    def drive_limits_turns(self) -> bool:
        """True if the drive's speed by itself keeps every turn within the lateral acceleration."""
        return self.drive.turns_within(self.lateral_mps2)

    def turn_at(self, speed_mps: float) -> tuple[float, float]:
        """Maximum curvature (1/m) and sharpness (1/m²) of turns at a speed (m/s)."""
        bend = self.drive.curvature_at(speed_mps)
        curvature = min(self.curvature_max_1pm, bend, self.lateral_mps2 / speed_mps**2)
        return curvature, min(self.sharpness_max_1pm2, self.drive.sharpness_at(speed_mps))

    def steady_speed_mps(self, curvature_1pm: float, sharpness_1pm2: float = 0.0) -> float:
        """Speed (m/s) at which a line, an arc or a clothoid up to this curvature is painted."""
        cap = self.square_cap(np.array([abs(curvature_1pm)]), np.array([abs(sharpness_1pm2)]))
        return min(self.paint_speed_mps, float(np.sqrt(cap[0])))

    def stopping_distance_m(self, speed_mps: float) -> float:
        """Distance (m) to stop from `speed_mps` on a straight, or to reach it."""
        return speed_mps * speed_mps / (2.0 * self.acceleration_mps2)


def _option(name: str, asked: float, default: float, low: float, high: float, unit: str) -> float:
    value = asked if asked != 0.0 else default
    if not low <= value <= high:
        instead = "or 0 for the vehicle's own" if asked != 0.0 else "or give the vehicle other figures: this is its own"
        raise PlanningError("", f"has {name} = {value:g}", f"give {low:g} to {high:g} {unit}, {instead}")
    return value
