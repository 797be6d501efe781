"""A lidar with a few beams that knows where the walls are: ranges to them place the robot.

All that Touchline has to know of it is in this folder: data sheet, truth, emulation, measurement model and entry.
"""

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from touchline.onboard.estimation.auxiliary_models import OnboardSensor, ScalarUpdate
from touchline.onboard.filter_model import EAST, HEADING, NORTH, STATES
from touchline.schemas.plugins import KindParts, Plugin
from touchline.schemas.sensor_truth import SensorTruth
from touchline.schemas.vehicles import SensorSpec
from touchline.services.robot_sim.sensors.auxiliary_truth import WorldSensor

Wall = tuple[float, float, float, float]
NOTHING = -1.0
"""Range of a beam that meets no wall."""


class RangeFinderSpec(SensorSpec):
    """Data sheet of the range finder, with the walls that the robot's computer knows."""

    kind: Literal["range-finder"] = "range-finder"
    name: str = "lidar"
    rate_hz: Literal[5, 10, 20] = 10
    latency_s: Annotated[float, Field(ge=0, le=0.5)] = 0.05
    beams: Annotated[int, Field(ge=1, le=8)] = 4
    """Evenly spaced over the full circle; the first one looks ahead."""
    most_m: Annotated[float, Field(gt=0, le=200)] = 40.0
    sigma_m: Annotated[float, Field(gt=0, le=1)] = 0.02
    walls: tuple[Wall, ...] = ()
    """Ends (x, y, x, y) of known walls in the map frame."""


class RangeFinderTruth(SensorTruth):
    """The walls that there are, and how ranges err."""

    kind: Literal["range-finder"] = "range-finder"
    white_m: Annotated[float, Field(ge=0, le=1)] = 0.015
    walls: tuple[Wall, ...] = ()


def cast(walls, x, y, angle, most_m):
    """Range (m) from a place along an angle to the nearest wall, and that wall; NOTHING if there is none."""
    dx, dy, nearest, met = math.cos(angle), math.sin(angle), most_m, None
    for wall in walls:
        ex, ey = wall[2] - wall[0], wall[3] - wall[1]
        across = dx * ey - dy * ex
        if abs(across) < 1e-9:
            continue
        range_m = ((wall[0] - x) * ey - (wall[1] - y) * ex) / across
        along = ((wall[0] - x) * dy - (wall[1] - y) * dx) / across
        if 0.0 < range_m < nearest and 0.0 <= along <= 1.0:
            nearest, met = range_m, wall
    return (nearest, met) if met is not None else (NOTHING, None)


def angles(spec, heading_rad):
    """Angles of the beams in the map frame."""
    return [heading_rad + 2.0 * math.pi * beam / spec.beams for beam in range(spec.beams)]


def mounted(spec, east_m, north_m, heading_rad):
    """Place of the sensor in the map frame."""
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    return east_m + cos * spec.x_m - sin * spec.y_m, north_m + sin * spec.x_m + cos * spec.y_m


class RangeFinderInWorld(WorldSensor):
    """Measures a range (m) with each beam; NOTHING where there is no wall."""

    def measure(self, tick, body, effects):
        place = mounted(self.spec, body.east_m, body.north_m, body.heading_rad)
        ranges = []
        for beam, angle in enumerate(angles(self.spec, body.heading_rad)):
            range_m, wall = cast(self.truth.walls, *place, angle, self.spec.most_m)
            ranges.append(NOTHING if wall is None else range_m + self.truth.white_m * self.draw.normal(tick, beam))
        return tuple(ranges)


class RangeFinderOnboard(OnboardSensor):
    """z = n·(w − p) / n·d for a wall with normal n through w, a beam's direction d, and the sensor's place p."""

    def updates(self, values, state):
        spec, found = self.spec, []
        east_m, north_m, heading_rad = state[EAST], state[NORTH], state[HEADING]
        x, y = mounted(spec, east_m, north_m, heading_rad)
        for measured_m, angle in zip(values, angles(spec, heading_rad), strict=True):
            expected_m, wall = cast(spec.walls, x, y, angle, spec.most_m)
            if measured_m == NOTHING or wall is None:
                continue
            nx, ny = wall[3] - wall[1], wall[0] - wall[2]
            along = nx * math.cos(angle) + ny * math.sin(angle)
            turned = nx * -math.sin(angle) + ny * math.cos(angle)
            jacobian = np.zeros(STATES)
            jacobian[EAST], jacobian[NORTH] = -nx / along, -ny / along
            arm = nx * (north_m - y) + ny * (x - east_m)  # of the place by the heading, times the normal
            jacobian[HEADING] = -arm / along - expected_m * turned / along
            found.append(ScalarUpdate(measured_m - expected_m, jacobian, spec.sigma_m**2))
        return found


PLUGIN = Plugin(
    "lidar with a few beams, placed by known walls",
    KindParts(RangeFinderSpec, onboard=RangeFinderOnboard, world=RangeFinderInWorld, truth=RangeFinderTruth),
)
