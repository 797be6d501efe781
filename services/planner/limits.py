"""The limits that a plan keeps: the vehicle's, and what the options ask for within them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.vehicle import Vehicle
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.method_choice import method_of

# Beyond these a plan would be nonsense (turns of 100 m radius, puddles of paint) rather than merely poor.
CURVATURE_MIN_1PM = 0.01
SHARPNESS_RANGE_1PM2 = (0.001, 1000.0)
SPEED_MIN_MPS = 0.05
# This share of the wheels' acceleration is planned with, so that rounding never shows.
RIM_SHARE = 1.0 - 1e-6
# The tightest turn, as a share of 1/r: there the inner wheel stands still.
CURVATURE_SHARE = 0.98
# Turns on offer are made for these speeds, the slower the tighter; of the wheels' acceleration they take this share.
TURN_SPEEDS_MPS = (0.6, 0.8, 1.0, 1.25, 1.5, 1.8)
TURNING_SHARE = 0.8
# Curvature (1/m) and sharpness (1/m²) below this limit no speed.
STRAIGHT = 1e-9


@dataclass(frozen=True)
class Limits:
    """Curvature (1/m), sharpness (1/m²), speeds (m/s) and accelerations (m/s²; `rim_*` at the wheels' rims)."""

    curvature_max_1pm: float
    sharpness_max_1pm2: float
    paint_speed_mps: float
    transit_speed_mps: float
    acceleration_mps2: float
    half_track_m: float
    rim_speed_mps: float
    rim_acceleration_mps2: float
    lateral_mps2: float

    @classmethod
    def of(cls, vehicle: Vehicle, options: PlanOptions) -> "Limits":
        """The limits for `options`, where 0 means the vehicle's default.

        Transit is at least as fast as paint, unless a lower transit speed alone is asked for: then paint is as slow.

        Raises:
            PlanningError: An option is not finite, not positive, or beyond what the vehicle can do; or paint shall be
                faster than transit; or there is no such method.
        """
        rim_speed = vehicle.max_wheel_speed_radps * vehicle.wheel_radius_m
        wheel_acceleration = min(vehicle.planned_wheel_acceleration_radps2, vehicle.max_wheel_acceleration_radps2)
        rim_acceleration = RIM_SHARE * wheel_acceleration * vehicle.wheel_radius_m
        half_track = 0.5 * vehicle.track_width_m
        # In a tighter turn than 1/r the inner wheel would run backward, in the middle of a forward path.
        curvatures = (CURVATURE_MIN_1PM, 1.0 / half_track)
        # A method with one turn for all speeds turns as the vehicle's data say; else the wheels' dynamics do.
        by_dynamics = method_of(options).by_dynamics
        tightest = CURVATURE_SHARE / half_track if by_dynamics else vehicle.default_kappa_max_1pm
        curvature = _option("kappa_max_1pm", options.kappa_max_1pm, tightest, *curvatures, "1/m")
        sharpest = vehicle.default_sigma_max_1pm2
        if by_dynamics:
            sharpest = turn_sharpness_1pm2(TURN_SPEEDS_MPS[0], rim_acceleration, half_track)
            sharpest = min(sharpest, SHARPNESS_RANGE_1PM2[1])
        sharpness = _option("sigma_max_1pm2", options.sigma_max_1pm2, sharpest, *SHARPNESS_RANGE_1PM2, "1/m²")
        speeds = (SPEED_MIN_MPS, rim_speed, "m/s")
        paint = _option("paint_speed_mps", options.paint_speed_mps, vehicle.paint_speed_mps, *speeds)
        transit = _option("transit_speed_mps", options.transit_speed_mps, vehicle.transit_speed_mps, *speeds)
        if options.transit_speed_mps == 0.0:
            transit = max(transit, paint)
        elif options.paint_speed_mps > transit:
            raise PlanningError(
                "",
                f"has paint_speed_mps = {paint:g} above transit_speed_mps = {transit:g}",
                "give a transit speed of at least the paint speed, or 0 for one that suits",
            )
        paint = min(paint, transit)
        acceleration = min(vehicle.max_acceleration_mps2, rim_acceleration)
        lateral = vehicle.max_lateral_acceleration_mps2
        return cls(curvature, sharpness, paint, transit, acceleration, half_track, rim_speed, rim_acceleration, lateral)

    @cached_property
    def row(self) -> Floats:
        """The limits as the kernels take them (see speed/topp.py)."""
        return np.array(
            (
                self.transit_speed_mps,
                self.rim_speed_mps,
                self.rim_acceleration_mps2,
                self.half_track_m,
                self.acceleration_mps2,
                self.lateral_mps2,
            )
        )

    def square_cap(self, curvature_1pm: Floats, sharpness_1pm2: Floats) -> Floats:
        """The largest v² (m²/s²) at |curvature| and |sharpness|, both (n,).

        The outer rim runs at v(1 + |κ|r); where v² alone takes v²|σ|r of the rims' acceleration, all of it is given.
        """
        square = np.square(
            np.minimum(self.transit_speed_mps, self.rim_speed_mps / (1.0 + curvature_1pm * self.half_track_m))
        )
        square = np.minimum(square, self.lateral_mps2 / np.maximum(curvature_1pm, STRAIGHT))
        return np.minimum(square, self.rim_acceleration_mps2 / np.maximum(sharpness_1pm2 * self.half_track_m, STRAIGHT))

    @property
    def wheels_limit_turns(self) -> bool:
        """Whether the wheels' speed alone keeps every turn within the lateral acceleration.

        With the outer rim at v_w a robot at v is accelerated by v(v_w - v)/r across, at most v_w²/(4r).
        """
        return self.lateral_mps2 >= self.rim_speed_mps**2 / (4.0 * self.half_track_m)

    def turn_at(self, speed_mps: float) -> tuple[float, float]:
        """The tightest curvature (1/m) and largest sharpness (1/m²) to turn with at a speed (m/s)."""
        rim = (self.rim_speed_mps - speed_mps) / (speed_mps * self.half_track_m)
        curvature = min(self.curvature_max_1pm, rim, self.lateral_mps2 / speed_mps**2)
        sharpness = turn_sharpness_1pm2(speed_mps, self.rim_acceleration_mps2, self.half_track_m)
        return curvature, min(self.sharpness_max_1pm2, sharpness)

    def steady_speed_mps(self, curvature_1pm: float, sharpness_1pm2: float = 0.0) -> float:
        """The speed (m/s) at which a line, an arc or a clothoid up to this curvature is painted."""
        cap = self.square_cap(np.array([abs(curvature_1pm)]), np.array([abs(sharpness_1pm2)]))
        return min(self.paint_speed_mps, float(np.sqrt(cap[0])))

    def stopping_distance_m(self, speed_mps: float) -> float:
        """Distance to stop from `speed_mps` on a straight, or to reach it."""
        return speed_mps * speed_mps / (2.0 * self.acceleration_mps2)


def turn_sharpness_1pm2(speed_mps: float, rim_acceleration_mps2: float, half_track_m: float) -> float:
    """The sharpness of a turn at constant speed that leaves the wheels something for braking and speeding up."""
    return TURNING_SHARE * rim_acceleration_mps2 / (half_track_m * speed_mps**2)


def _option(name: str, asked: float, default: float, low: float, high: float, unit: str) -> float:
    value = asked if asked != 0.0 else default
    if not low <= value <= high:
        instead = "or 0 for the vehicle's own" if asked != 0.0 else "or give the vehicle other figures: this is its own"
        raise PlanningError("", f"has {name} = {value:g}", f"give {low:g} to {high:g} {unit}, {instead}")
    return value
