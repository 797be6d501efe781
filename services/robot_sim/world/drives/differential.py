"""The world's side of a `DifferentialDrive`: two motors with their wheels, and casters."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.core.jit import kernel
from touchline.services.core.random import STREAM_CHASSIS, STREAM_SLIP, normal
from touchline.services.robot_sim.world.body import P_DRIVE, P_SLIP_DECAY, P_SLIP_SIGMA
from touchline.services.robot_sim.world.drives import differential_layout as d
from touchline.services.robot_sim.world.drives.differential_ground import roll_on
from touchline.services.robot_sim.world.drives.differential_layout import (
    LEFT_RATE,
    LEFT_SLIP,
    RIGHT_SLIP,
)
from touchline.services.robot_sim.world.drives.differential_motors import actuate
from touchline.services.robot_sim.world.drives.world_drive import WorldDrive
from touchline.services.robot_sim.world.kernel_class import KernelClass
from touchline.services.robot_sim.world.lag import share_per_step

CURRENT_LAG_S: Final = 0.002
"""Of the amplifier's current loop."""
CONTROLLER_RADPS: Final = 60.0
"""Bandwidth of the drives' speed controllers."""
CONTROLLER_INTEGRAL_S: Final = 0.08

_AT_REST: Final = [first + wheel for first in (LEFT_RATE, d.REFERENCE, d.TORQUE, d.INTEGRAL) for wheel in range(2)]

Floats = NDArray[np.float64]


class DifferentialKernels(KernelClass):
    """What physics calls; all figures are in the world's arrays."""

    @kernel
    def begin_tick(self, state: Floats, p: Floats, seed: int, tick: int) -> None:
        """Let the random slip of both wheels go on: a first-order Gauss-Markov process each.

        s(t + T) = s(t)·exp(−T/τ) + σ·√(1 − exp(−2T/τ))·w (A. Gelb, ed., "Applied Optimal Estimation", 1974, sec. 2.2).

        Args:
            state: (body.DRIVE + STATE_SIZE,) the world's; the slips are updated, shares of ground speed.
            p: (body.P_DRIVE + PARAMETER_SIZE,) the world's parameters; of them σ and the decay in a tick.
            seed: Of the scenario.
            tick: Onboard tick that begins.
        """
        fresh = p[P_SLIP_SIGMA] * math.sqrt(1.0 - p[P_SLIP_DECAY] * p[P_SLIP_DECAY])
        if fresh > 0.0:
            state[LEFT_SLIP] = p[P_SLIP_DECAY] * state[LEFT_SLIP] + fresh * normal(seed, STREAM_SLIP, tick, 0)
            state[RIGHT_SLIP] = p[P_SLIP_DECAY] * state[RIGHT_SLIP] + fresh * normal(seed, STREAM_SLIP, tick, 1)

    actuate = actuate
    roll_on = roll_on


class DifferentialInWorld(WorldDrive):
    """The wheels as they are: each seed has its own errors of radius and track on top of the nominal ones."""

    kernels = DifferentialKernels()
    state_size = d.STATE_SIZE

    def __init__(self, vehicle: Vehicle, scenario: Scenario) -> None:
        """Of this vehicle, under this seed; the scenario must be effective."""
        p = np.zeros(P_DRIVE + d.PARAMETER_SIZE)
        _chassis(p, vehicle, scenario)
        _motors(p, vehicle)
        self.parameters = p[P_DRIVE:]

    def rest(self, state: Floats) -> None:
        """Wheels, motors and their controllers at rest, the casters behind."""
        state[_AT_REST] = 0.0
        state[d.CASTER_X], state[d.CASTER_Y] = 1.0, 0.0


def _chassis(p: Floats, vehicle: Vehicle, scenario: Scenario) -> None:
    drive, errors = vehicle.drive, scenario.drive
    for wheel, place in enumerate((d.P_LEFT_RADIUS, d.P_RIGHT_RADIUS)):
        error = errors.wheel_radius_relative * normal(scenario.seed, STREAM_CHASSIS, 0, wheel)
        p[place] = drive.wheel_radius_m * (1.0 + error)
    error = errors.track_width_relative * normal(scenario.seed, STREAM_CHASSIS, 0, 2)
    p[d.P_TRACK] = drive.track_width_m * (1.0 + error)
    p[d.P_CASTER_X], p[d.P_CASTER_TRAIL] = drive.caster_x_m, drive.caster_trail_m
    p[d.P_CASTER_SHARE] = drive.caster_load_share


def _motors(p: Floats, vehicle: Vehicle) -> None:
    drive, motor = vehicle.drive, vehicle.drive.motor
    p[d.P_MAX_RATE] = drive.max_wheel_speed_radps
    p[d.P_MAX_ACCEL] = drive.max_wheel_acceleration_radps2
    p[d.P_LAG] = share_per_step(drive.motor_time_constant_s)
    p[d.P_WHEEL_INERTIA] = motor.inertia_kgm2
    p[d.P_TORQUE_PER_A] = motor.constant_nm_per_a * motor.gear_ratio * motor.gear_efficiency
    p[d.P_EMF] = motor.constant_nm_per_a * motor.gear_ratio
    p[d.P_RESISTANCE], p[d.P_MAX_CURRENT] = motor.resistance_ohm, motor.max_current_a
    p[d.P_FRICTION], p[d.P_VISCOUS] = motor.friction_nm, motor.viscous_nms
    p[d.P_CURRENT_LAG] = share_per_step(CURRENT_LAG_S)
    # What each wheel has to turn: itself, its half of the mass, its share of the body's inertia.
    mass = 0.5 * (vehicle.body.mass_empty_kg + vehicle.mass_full_kg)
    lever = drive.wheel_radius_m / drive.half_track_m
    common = motor.inertia_kgm2 + 0.5 * mass * drive.wheel_radius_m**2
    turning = motor.inertia_kgm2 + 0.5 * mass * (vehicle.body.radius_of_gyration_m * lever) ** 2
    p[d.P_AHEAD_COMMON], p[d.P_AHEAD_TURN] = common, turning
    p[d.P_GAIN] = CONTROLLER_RADPS * 0.5 * (common + turning)
    p[d.P_INTEGRAL_GAIN] = p[d.P_GAIN] / CONTROLLER_INTEGRAL_S
