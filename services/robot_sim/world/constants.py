"""The world's constants for one vehicle and one scenario."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.core.random import STREAM_CHASSIS, normal
from touchline.services.onboard.interface import TICK_S
from touchline.services.robot_sim.world import body
from touchline.services.robot_sim.world.motors import share_per_step

CURRENT_LAG_S: Final = 0.002
"""Of the amplifier's current loop."""
CONTROLLER_RADPS: Final = 60.0
"""Bandwidth of the drives' speed controllers."""
CONTROLLER_INTEGRAL_S: Final = 0.08


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
}


def constants(vehicle: Vehicle, scenario: Scenario) -> NDArray[np.float64]:
    """(body.PARAMETER_SIZE,) of the world; `scenario` must be effective."""
    p = np.zeros(body.PARAMETER_SIZE)
    _chassis(p, vehicle, scenario)
    _drives(p, vehicle)
    _sprayer(p, vehicle)
    surface = SURFACES[scenario.ground.surface]
    p[body.P_GRIP], p[body.P_ROLLING] = surface.grip, surface.rolling
    p[body.P_STIFFNESS_X], p[body.P_STIFFNESS_Y] = surface.stiffness_x, surface.stiffness_y
    p[body.P_SLIP_SIGMA] = scenario.drive.slip_relative * surface.slip
    p[body.P_SLIP_DECAY] = math.exp(-TICK_S / scenario.drive.slip_tau_s)
    p[body.P_GRADE] = scenario.ground.grade
    p[body.P_UPHILL_EAST] = math.cos(scenario.ground.uphill_rad)
    p[body.P_UPHILL_NORTH] = math.sin(scenario.ground.uphill_rad)
    return p


def _chassis(p: NDArray[np.float64], vehicle: Vehicle, scenario: Scenario) -> None:
    drive, seed = scenario.drive, scenario.seed
    for wheel in (body.P_LEFT_RADIUS, body.P_RIGHT_RADIUS):
        error = drive.wheel_radius_relative * normal(seed, STREAM_CHASSIS, 0, wheel)
        p[wheel] = vehicle.drive.wheel_radius_m * (1.0 + error)
    error = drive.track_width_relative * normal(seed, STREAM_CHASSIS, 0, body.P_TRACK)
    p[body.P_TRACK] = vehicle.drive.track_width_m * (1.0 + error)
    p[body.P_MASS] = vehicle.body.mass_empty_kg
    p[body.P_PAINT_KGPL] = (vehicle.tool.mass_full_kg - vehicle.body.mass_empty_kg) / vehicle.tool.tank_l
    p[body.P_GYRATION2] = vehicle.body.radius_of_gyration_m**2
    p[body.P_CASTER_X], p[body.P_CASTER_TRAIL] = vehicle.drive.caster_x_m, vehicle.drive.caster_trail_m
    p[body.P_CASTER_SHARE] = vehicle.drive.caster_load_share
    p[body.P_BATTERY_WH], p[body.P_IDLE_W] = vehicle.body.battery_wh, vehicle.body.idle_power_w


def _drives(p: NDArray[np.float64], vehicle: Vehicle) -> None:
    motor = vehicle.drive.motor
    p[body.P_MAX_RATE] = vehicle.drive.max_wheel_speed_radps
    p[body.P_MAX_ACCEL] = vehicle.drive.max_wheel_acceleration_radps2
    p[body.P_LAG] = share_per_step(vehicle.drive.motor_time_constant_s)
    p[body.P_WHEEL_INERTIA] = motor.inertia_kgm2
    p[body.P_TORQUE_PER_A] = motor.constant_nm_per_a * motor.gear_ratio * motor.gear_efficiency
    p[body.P_EMF] = motor.constant_nm_per_a * motor.gear_ratio
    p[body.P_RESISTANCE], p[body.P_MAX_CURRENT] = motor.resistance_ohm, motor.max_current_a
    p[body.P_FRICTION], p[body.P_VISCOUS] = motor.friction_nm, motor.viscous_nms
    p[body.P_CURRENT_LAG] = share_per_step(CURRENT_LAG_S)
    # What each wheel has to turn: itself, its half of the mass, its share of the body's inertia.
    mass = 0.5 * (vehicle.body.mass_empty_kg + vehicle.tool.mass_full_kg)
    lever = vehicle.drive.wheel_radius_m / vehicle.drive.half_track_m
    common = motor.inertia_kgm2 + 0.5 * mass * vehicle.drive.wheel_radius_m**2
    turning = motor.inertia_kgm2 + 0.5 * mass * (vehicle.body.radius_of_gyration_m * lever) ** 2
    p[body.P_AHEAD_COMMON], p[body.P_AHEAD_TURN] = common, turning
    p[body.P_GAIN] = CONTROLLER_RADPS * 0.5 * (common + turning)
    p[body.P_INTEGRAL_GAIN] = p[body.P_GAIN] / CONTROLLER_INTEGRAL_S


def _sprayer(p: NDArray[np.float64], vehicle: Vehicle) -> None:
    p[body.P_NOZZLE_X], p[body.P_NOZZLE_Y] = vehicle.tool.nozzle_x_m, vehicle.tool.nozzle_y_m
    p[body.P_VALVE_ON] = _travel(vehicle.tool.valve_on_delay_s)
    p[body.P_VALVE_OFF] = _travel(vehicle.tool.valve_off_delay_s)
    p[body.P_DISC] = _travel(vehicle.tool.disc_delay_s)
    p[body.P_FLOW_LPS] = vehicle.tool.paint_l_per_m * vehicle.tool.paint_speed_mps


def _travel(delay_s: float) -> float:
    """Plunger travel in one physics step; a whole stroke when there is no delay."""
    return min(1.0, body.STEP_S / delay_s) if delay_s > 0.0 else 1.0
