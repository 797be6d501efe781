"""World side of a `RearSteeredDrive`: a motor with its drum, and a steered wheel."""

from __future__ import annotations

import math
from typing import Final

from touchline.core.jit import kernel
from touchline.core.random import STREAM_CHASSIS, STREAM_SLIP, normal
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.world.body import STEP_S, BodyFigures
from touchline.services.robot_sim.world.drives.dc_motor import dc_motor
from touchline.services.robot_sim.world.drives.rear_steered_actuators import actuate
from touchline.services.robot_sim.world.drives.rear_steered_ground import roll_on
from touchline.services.robot_sim.world.drives.true_rear_steered import RearSteeredState, TrueRearSteered
from touchline.services.robot_sim.world.drives.world_drive import WorldDrive
from touchline.services.robot_sim.world.lag import share_per_step

CURRENT_LAG_S: Final = 0.005
"""Time constant of the amplifier's current loop."""
CONTROLLER_RADPS: Final = 30.0
"""Bandwidth of the drum's speed controller."""
CONTROLLER_INTEGRAL_S: Final = 0.15


class RearSteeredKernels(TrueRearSteered):
    """Parameters of the drive with the kernels that physics calls."""

    @kernel
    def begin_tick(self, drum: RearSteeredState, body: BodyFigures, seed: int, tick: int) -> None:
        """See `world_drive.begin_tick`: the drum's random slip advances, a first-order Gauss-Markov process.

        s(t + T) = s(t)·exp(−T/τ) + σ·√(1 − exp(−2T/τ))·w (A. Gelb, ed., "Applied Optimal Estimation", 1974, sec. 2.2).
        """
        fresh = body.slip_sigma * math.sqrt(1.0 - body.slip_decay * body.slip_decay)
        if fresh > 0.0:
            drum.slip = body.slip_decay * drum.slip + fresh * normal(seed, STREAM_SLIP, tick, 0)

    actuate = actuate
    roll_on = roll_on


class RearSteeredInWorld(WorldDrive):
    """A drum and a steered wheel in the world."""

    state: RearSteeredState

    def __init__(self, vehicle: Vehicle, scenario: Scenario) -> None:
        """Take the parameters of a vehicle, with errors by the seed; the scenario must be effective."""
        drive, errors, motor = vehicle.drive, scenario.drive, vehicle.drive.motor
        radius, base, offset = (normal(scenario.seed, STREAM_CHASSIS, 0, channel) for channel in range(3))
        ahead = motor.inertia_kgm2 + vehicle.mass_full_kg * drive.drum_radius_m**2
        self.state = RearSteeredState()
        self.centre_x_m = -drive.wheelbase_m * (1.0 - drive.drum_load_share)
        self.figures = RearSteeredKernels(
            radius_m=drive.drum_radius_m * (1.0 + errors.wheel_radius_relative * radius),
            base_m=drive.wheelbase_m * (1.0 + errors.track_width_relative * base),
            behind_m=drive.wheelbase_m * (1.0 - drive.drum_load_share),
            drum_share=drive.drum_load_share,
            offset_rad=errors.steering_offset_rad * offset,
            stop_rad=drive.steering_stop_rad,
            steering_step_rad=drive.steering_rate_limit_radps * STEP_S,
            steering_lag=share_per_step(drive.steering_time_constant_s),
            max_rate_radps=drive.max_drum_speed_radps,
            max_step_radps=drive.max_drum_acceleration_radps2 * STEP_S,
            lag=share_per_step(drive.drum_time_constant_s),
            inertia_kgm2=motor.inertia_kgm2,
            motor=dc_motor(motor, CURRENT_LAG_S, CONTROLLER_RADPS * ahead, CONTROLLER_INTEGRAL_S),
            friction_nm=motor.friction_nm,
            viscous_nms=motor.viscous_nms,
            ahead_kgm2=ahead,
        )

    def rest(self) -> None:
        """Put the drum, its motor and controller at rest; its slip is kept."""
        self.state.reset(slip=self.state.slip)
