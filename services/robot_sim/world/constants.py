"""Constants of the world for one vehicle and one scenario."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from touchline.onboard.interface import TICK_S
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.world.body import BodyFigures


class Surface(NamedTuple):
    """Properties of a surface for tyres."""

    grip: float
    """Largest force over load."""
    stiffness_x: float
    """Longitudinal force over load per unit of slip."""
    stiffness_y: float
    """The same, lateral."""
    rolling: float
    """Rolling resistance over load."""
    slip: float
    """Random slip, relative to that of the scenario."""


SURFACES: Final = {
    "grass": Surface(grip=0.6, stiffness_x=15.0, stiffness_y=20.0, rolling=0.06, slip=1.0),
    "wet-grass": Surface(grip=0.35, stiffness_x=9.0, stiffness_y=12.0, rolling=0.085, slip=1.5),
    "artificial-turf": Surface(grip=0.8, stiffness_x=22.0, stiffness_y=26.0, rolling=0.04, slip=0.4),
    "floor": Surface(grip=0.7, stiffness_x=25.0, stiffness_y=28.0, rolling=0.015, slip=0.2),
    "clay": Surface(grip=0.45, stiffness_x=12.0, stiffness_y=16.0, rolling=0.12, slip=1.5),
}


def constants(vehicle: Vehicle, scenario: Scenario) -> BodyFigures:
    """Compute the constants of a vehicle's body on the ground of a scenario.

    Args:
        vehicle: The vehicle.
        scenario: The scenario, which must be effective.
    """
    body, tool, ground = vehicle.body, vehicle.tool, scenario.ground
    surface = SURFACES[ground.surface]
    return BodyFigures(
        *tool.point_m,
        idle_w=body.idle_power_w,
        mass_kg=body.mass_empty_kg,
        load_kgpl=(vehicle.mass_full_kg - body.mass_empty_kg) / tool.capacity_l if tool.capacity_l > 0.0 else 0.0,
        battery_wh=body.battery_wh,
        gyration_m2=body.radius_of_gyration_m**2,
        grip=surface.grip,
        stiffness_x=surface.stiffness_x,
        stiffness_y=surface.stiffness_y,
        rolling=surface.rolling,
        slip_sigma=scenario.drive.slip_relative * surface.slip,
        slip_decay=math.exp(-TICK_S / scenario.drive.slip_tau_s),
        grade=ground.grade,
        uphill_east=math.cos(ground.uphill_rad),
        uphill_north=math.sin(ground.uphill_rad),
        crab_rad=scenario.truth.crab_rad,
        wander_rad=scenario.truth.wander_rad,
        wander_1pm=1.0 / scenario.truth.wander_m,
        drift_east_m=scenario.truth.drift_east_m,
        drift_north_m=scenario.truth.drift_north_m,
        docks=np.array([(each.x_m, each.y_m, each.reach_m, each.power_w) for each in scenario.docks]).reshape(-1, 4),
    )
