"""The world's side of a `RearSteeredDrive`: a motor with its drum, and a steered wheel."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.core.jit import kernel
from touchline.services.core.random import STREAM_CHASSIS, STREAM_SLIP, normal
from touchline.services.robot_sim.world.body import P_DRIVE, P_SLIP_DECAY, P_SLIP_SIGMA, STEP_S
from touchline.services.robot_sim.world.drives import rear_steered_layout as r
from touchline.services.robot_sim.world.drives.rear_steered_actuators import actuate
from touchline.services.robot_sim.world.drives.rear_steered_ground import roll_on
from touchline.services.robot_sim.world.drives.world_drive import WorldDrive
from touchline.services.robot_sim.world.kernel_class import KernelClass
from touchline.services.robot_sim.world.lag import share_per_step

CURRENT_LAG_S: Final = 0.005
"""Of the amplifier's current loop."""
CONTROLLER_RADPS: Final = 30.0
"""Bandwidth of the drum's speed controller."""
CONTROLLER_INTEGRAL_S: Final = 0.15

_AT_REST: Final = [r.DRUM_RATE, r.REFERENCE, r.TORQUE, r.INTEGRAL, r.TRACTION, r.SIDE_FORCE]

Floats = NDArray[np.float64]


class RearSteeredKernels(KernelClass):
    """What physics calls; all figures are in the world's arrays."""

    @kernel
    def begin_tick(self, state: Floats, p: Floats, seed: int, tick: int) -> None:
        """See `world_drive.begin_tick`: the drum's random slip goes on, a first-order Gauss-Markov process.

        s(t + T) = s(t)·exp(−T/τ) + σ·√(1 − exp(−2T/τ))·w (A. Gelb, ed., "Applied Optimal Estimation", 1974, sec. 2.2).
        """
        fresh = p[P_SLIP_SIGMA] * math.sqrt(1.0 - p[P_SLIP_DECAY] * p[P_SLIP_DECAY])
        if fresh > 0.0:
            state[r.DRUM_SLIP] = p[P_SLIP_DECAY] * state[r.DRUM_SLIP] + fresh * normal(seed, STREAM_SLIP, tick, 0)

    actuate = actuate
    roll_on = roll_on


class RearSteeredInWorld(WorldDrive):
    """As it is: each seed has its own errors of radius, wheelbase and steering on top of the nominal figures."""

    kernels = RearSteeredKernels()
    state_size = r.STATE_SIZE

    def __init__(self, vehicle: Vehicle, scenario: Scenario) -> None:
        """Of this vehicle, under this seed; the scenario must be effective."""
        p = np.zeros(P_DRIVE + r.PARAMETER_SIZE)
        _chassis(p, vehicle, scenario)
        _motor(p, vehicle)
        self.parameters = p[P_DRIVE:]

    def rest(self, state: Floats) -> None:
        """The drum, its motor and controller at rest; the steering stays as it is."""
        state[_AT_REST] = 0.0


def _chassis(p: Floats, vehicle: Vehicle, scenario: Scenario) -> None:
    drive, errors, seed = vehicle.drive, scenario.drive, scenario.seed
    radius, base, offset = (normal(seed, STREAM_CHASSIS, 0, channel) for channel in range(3))
    p[r.P_RADIUS] = drive.drum_radius_m * (1.0 + errors.wheel_radius_relative * radius)
    p[r.P_BASE] = drive.wheelbase_m * (1.0 + errors.track_width_relative * base)
    p[r.P_OFFSET] = errors.steering_offset_rad * offset
    p[r.P_DRUM_SHARE] = drive.drum_load_share
    p[r.P_BEHIND] = drive.wheelbase_m * (1.0 - drive.drum_load_share)
    p[r.P_STOP] = drive.steering_stop_rad
    p[r.P_STEERING_STEP] = drive.steering_rate_limit_radps * STEP_S
    p[r.P_STEERING_LAG] = share_per_step(drive.steering_time_constant_s)


def _motor(p: Floats, vehicle: Vehicle) -> None:
    drive, motor = vehicle.drive, vehicle.drive.motor
    p[r.P_MAX_RATE] = drive.max_drum_speed_radps
    p[r.P_MAX_STEP] = drive.max_drum_acceleration_radps2 * STEP_S
    p[r.P_LAG] = share_per_step(drive.drum_time_constant_s)
    p[r.P_INERTIA] = motor.inertia_kgm2
    p[r.P_TORQUE_PER_A] = motor.constant_nm_per_a * motor.gear_ratio * motor.gear_efficiency
    p[r.P_EMF] = motor.constant_nm_per_a * motor.gear_ratio
    p[r.P_RESISTANCE], p[r.P_MAX_CURRENT] = motor.resistance_ohm, motor.max_current_a
    p[r.P_FRICTION], p[r.P_VISCOUS] = motor.friction_nm, motor.viscous_nms
    p[r.P_CURRENT_LAG] = share_per_step(CURRENT_LAG_S)
    p[r.P_AHEAD] = motor.inertia_kgm2 + vehicle.mass_full_kg * drive.drum_radius_m**2
    p[r.P_GAIN] = CONTROLLER_RADPS * p[r.P_AHEAD]
    p[r.P_INTEGRAL_GAIN] = p[r.P_GAIN] / CONTROLLER_INTEGRAL_S
    p[r.P_INTEGRAL_LIMIT] = p[r.P_TORQUE_PER_A] * motor.max_current_a
