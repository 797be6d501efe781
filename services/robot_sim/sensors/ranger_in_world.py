"""Emulated ultrasonic ranger: the nearest echo from within its cone, its own or a neighbour's."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.vehicles.sensor_spec import SensorSpec
from touchline.services.robot_sim.sensors.auxiliary_truth import WorldSensor
from touchline.services.robot_sim.sensors.lidar_scan import LidarFigures, ScanArrays, see
from touchline.services.robot_sim.world.body import BodyState
from touchline.services.robot_sim.world.effects import Effects
from touchline.services.robot_sim.world.objects.things import POSES

_RAYS: Final = 33
"""Rays of a cone; the echo is that of a surface that faces the ranger, so the nearest along them, not at the edge."""


class _Echo(NamedTuple):
    distance_m: float
    east_m: float
    north_m: float


class RangerInWorld(WorldSensor):
    """Measures the distance of the nearest echo [m]; inf without one."""

    def measure(self, tick: int, _body: BodyState, _effects: Effects) -> tuple[float, ...]:
        """Return the distance; see `WorldSensor.measure`."""
        spec, truth, draw = self.spec, self.truth, self.draw
        own = self._echo(spec, tick)
        distance = own.distance_m if own is not None else math.inf
        for other in self.surroundings.vehicle.sensors:
            if other.kind == spec.kind and other.name != spec.name and other.rate_hz == spec.rate_hz:
                heard = self._echo(other, tick)
                if heard is not None:
                    distance = min(distance, 0.5 * (heard.distance_m + self._distance_of(heard, tick)))
        share = draw.uniform(tick)
        if share < truth.dropout_share:
            distance = math.inf
        elif share < truth.dropout_share + truth.weed_share:
            distance = min(distance, spec.min_m + (spec.max_m - spec.min_m) * draw.uniform(tick, 1))
        distance += spec.sigma_m * draw.normal(tick, 2)
        return (float(np.float32(distance)) if spec.min_m <= distance <= spec.max_m else math.inf,)

    def _echo(self, ranger: SensorSpec, tick: int) -> _Echo | None:
        """Return the nearest echo that a ranger of this robot hears of its own ping; None if there is none."""
        figures, scan = _figures(ranger), _arrays(ranger)
        see(figures, scan, self.surroundings.things, tick)
        ranges = scan.ranges
        inner = ranges[1:-1]
        faces = np.isfinite(inner) & (inner <= ranges[:-2]) & (inner <= ranges[2:])
        if not faces.any():
            return None
        ray = 1 + int(np.argmin(np.where(faces, inner, math.inf)))
        east, north, cos, sin = scan.rays[ray].tolist()
        distance = float(ranges[ray])
        return _Echo(distance, east + distance * cos, north + distance * sin)

    def _distance_of(self, echo: _Echo, tick: int) -> float:
        """Return the distance of this ranger from the place of an echo; inf if that is outside its cone."""
        spec, pose = self.spec, self.surroundings.things.trail[tick % POSES]
        cos, sin = math.cos(pose[2]), math.sin(pose[2])
        x = echo.east_m - pose[0] - cos * spec.x_m + sin * spec.y_m
        y = echo.north_m - pose[1] - sin * spec.x_m - cos * spec.y_m
        aside = math.remainder(math.atan2(y, x) - pose[2] - spec.direction_rad, 2.0 * math.pi)
        return math.hypot(x, y) if abs(aside) <= 0.5 * spec.cone_rad else math.inf


def _figures(ranger: SensorSpec) -> LidarFigures:
    """Return a ranger as a lidar without errors that looks once at all that is in its cone."""
    return LidarFigures(
        x_m=ranger.x_m,
        y_m=ranger.y_m,
        first_rad=ranger.direction_rad - 0.5 * ranger.cone_rad,
        step_rad=ranger.cone_rad / (_RAYS - 1),
        scan_s=0.0,
        height_m=ranger.height_m,
        descent=0.0,
        min_m=ranger.min_m,
        max_m=ranger.max_m,
        dark_m=ranger.max_m,
        sigma_m=0.0,
        sigma_relative=0.0,
        ground_sigma=0.0,
        bias_m=0.0,
        mixed=0.0,
        dropout=0.0,
        false_returns=0.0,
        false_within_m=0.0,
        sun_rad=math.nan,
        sun_half_rad=0.0,
        sun_dropout=0.0,
        seed=0,
        sensor=0,
        silent=True,
    )


def _arrays(ranger: SensorSpec) -> ScanArrays:
    angles = ranger.direction_rad + ranger.cone_rad * (np.arange(_RAYS) / (_RAYS - 1) - 0.5)
    none: NDArray[np.float64] = np.zeros(_RAYS)
    directions = np.column_stack((np.cos(angles), np.sin(angles)))
    return ScanArrays(directions, np.zeros((_RAYS, 4)), none, none.copy(), none.copy(), none.copy(), none.copy())
