"""The world's constants for one vehicle and one scenario."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.onboard.interface import TICK_S
from touchline.services.robot_sim.world import body


class Surface(NamedTuple):
    """What tyres find on it."""

    grip: float
    """Largest force over load."""
    stiffness_x: float
    """Force over load per unit of slip, along."""
    stiffness_y: float
    """The same across."""
    rolling: float
    """Rolling resistance over load."""
    slip: float
    """Random slip, against that of the scenario."""


SURFACES: Final = {
    "grass": Surface(grip=0.6, stiffness_x=15.0, stiffness_y=20.0, rolling=0.06, slip=1.0),
    "wet-grass": Surface(grip=0.35, stiffness_x=9.0, stiffness_y=12.0, rolling=0.085, slip=1.5),
    "artificial-turf": Surface(grip=0.8, stiffness_x=22.0, stiffness_y=26.0, rolling=0.04, slip=0.4),
    "clay": Surface(grip=0.45, stiffness_x=12.0, stiffness_y=16.0, rolling=0.12, slip=1.5),
}


def constants(vehicle: Vehicle, scenario: Scenario) -> NDArray[np.float64]:
    """(body.P_DRIVE,) what the world has whatever drive and tool it is; `scenario` must be effective."""
    p = np.zeros(body.P_DRIVE)
    p[body.P_POINT_X], p[body.P_POINT_Y] = vehicle.tool.point_m
    p[body.P_MASS] = vehicle.body.mass_empty_kg
    p[body.P_GYRATION2] = vehicle.body.radius_of_gyration_m**2
    p[body.P_BATTERY_WH], p[body.P_IDLE_W] = vehicle.body.battery_wh, vehicle.body.idle_power_w
    surface = SURFACES[scenario.ground.surface]
    p[body.P_GRIP], p[body.P_ROLLING] = surface.grip, surface.rolling
    p[body.P_STIFFNESS_X], p[body.P_STIFFNESS_Y] = surface.stiffness_x, surface.stiffness_y
    p[body.P_SLIP_SIGMA] = scenario.drive.slip_relative * surface.slip
    p[body.P_SLIP_DECAY] = math.exp(-TICK_S / scenario.drive.slip_tau_s)
    p[body.P_GRADE] = scenario.ground.grade
    p[body.P_UPHILL_EAST] = math.cos(scenario.ground.uphill_rad)
    p[body.P_UPHILL_NORTH] = math.sin(scenario.ground.uphill_rad)
    return p
