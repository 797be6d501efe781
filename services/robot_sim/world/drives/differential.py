"""World side of a `DifferentialDrive`: two motors with their wheels, and casters."""

from __future__ import annotations

import math
from typing import Final

from touchline.core.jit import kernel
from touchline.core.random import STREAM_CHASSIS, STREAM_SLIP, normal
from touchline.onboard.interface import TICK_S
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.world.body import STEP_S, BodyFigures
from touchline.services.robot_sim.world.drives.dc_motor import dc_motor
from touchline.services.robot_sim.world.drives.differential_ground import roll_on
from touchline.services.robot_sim.world.drives.differential_motors import actuate
from touchline.services.robot_sim.world.drives.true_differential import DifferentialState, TrueDifferential
from touchline.services.robot_sim.world.drives.world_drive import WorldDrive
from touchline.services.robot_sim.world.lag import share_per_step

CURRENT_LAG_S: Final = 0.002
"""Time constant of the amplifier's current loop."""
CONTROLLER_RADPS: Final = 60.0
"""Bandwidth of the drives' speed controllers."""
CONTROLLER_INTEGRAL_S: Final = 0.08
INTEGRAL_LIMIT_NM: Final = 40.0
WARMING_S: Final = 600.0
"""Time constant of the tyres' temperature."""


class DifferentialKernels(TrueDifferential):
    """Parameters of the drive with the kernels that physics calls."""

    @kernel
    def begin_tick(self, wheels: DifferentialState, body: BodyFigures, seed: int, tick: int) -> None:
        """Advance the random slip of both wheels, a first-order Gauss-Markov process each, and warm their tyres.

        s(t + T) = s(t)·exp(−T/τ) + σ·√(1 − exp(−2T/τ))·w (A. Gelb, ed., "Applied Optimal Estimation", 1974, sec. 2.2).

        Args:
            wheels: State of the drive; slips, shares of ground speed, and the tyres' warmth are updated.
            body: Gives σ and the decay in a tick.
            seed: Seed of the scenario.
            tick: Onboard tick that begins.
        """
        fresh = body.slip_sigma * math.sqrt(1.0 - body.slip_decay * body.slip_decay)
        if fresh > 0.0:
            wheels.slip[0] = body.slip_decay * wheels.slip[0] + fresh * normal(seed, STREAM_SLIP, tick, 0)
            wheels.slip[1] = body.slip_decay * wheels.slip[1] + fresh * normal(seed, STREAM_SLIP, tick, 1)
        if self.warming != 0.0:
            wheels.warm_relative = 1.0 + self.warming * (1.0 - math.exp(-TICK_S * tick / WARMING_S))

    actuate = actuate
    roll_on = roll_on


class DifferentialInWorld(WorldDrive):
    """Two wheels in the world."""

    state: DifferentialState

    def __init__(self, vehicle: Vehicle, scenario: Scenario) -> None:
        """Take the parameters of the real robot, with errors by the seed; the scenario must be effective."""
        drive, errors, motor, truth = vehicle.drive, scenario.drive, vehicle.drive.motor, scenario.truth
        left, right, track = (normal(scenario.seed, STREAM_CHASSIS, 0, channel) for channel in range(3))
        # Inertia that each wheel turns: its own, its half of the mass, its share of the body's inertia.
        mass = 0.5 * (vehicle.body.mass_empty_kg + vehicle.mass_full_kg)
        paint_kg, unlike = vehicle.mass_full_kg - vehicle.body.mass_empty_kg, 0.5 * truth.wheel_difference_relative
        lever = drive.wheel_radius_m / drive.half_track_m
        common = motor.inertia_kgm2 + 0.5 * mass * drive.wheel_radius_m**2
        turning = motor.inertia_kgm2 + 0.5 * mass * (vehicle.body.radius_of_gyration_m * lever) ** 2
        gain = CONTROLLER_RADPS * 0.5 * (common + turning)
        self.state = DifferentialState()
        self.figures = DifferentialKernels(
            radius_m=(
                drive.wheel_radius_m * (1.0 + errors.wheel_radius_relative * left - unlike),
                drive.wheel_radius_m * (1.0 + errors.wheel_radius_relative * right + unlike),
            ),
            load_1pkg=truth.tyre_load_relative / paint_kg if paint_kg > 0.0 else 0.0,
            mean_kg=mass,
            warming=truth.tyre_warming_relative,
            track_m=drive.track_width_m * (1.0 + errors.track_width_relative * track),
            max_rate_radps=drive.max_wheel_speed_radps,
            max_step_radps=drive.max_wheel_acceleration_radps2 * STEP_S,
            lag=share_per_step(drive.motor_time_constant_s),
            inertia_kgm2=motor.inertia_kgm2,
            motor=dc_motor(motor, CURRENT_LAG_S, gain, CONTROLLER_INTEGRAL_S, INTEGRAL_LIMIT_NM),
            friction_nm=motor.friction_nm,
            viscous_nms=motor.viscous_nms,
            ahead_common_kgm2=common,
            ahead_turn_kgm2=turning,
            caster_x_m=drive.caster_x_m,
            caster_share=drive.caster_load_share,
            caster_trail_m=drive.caster_trail_m,
        )

    def rest(self) -> None:
        """Put wheels, motors and their controllers at rest, with the casters behind; the slips are kept."""
        self.state.reset(slip=self.state.slip.copy())
