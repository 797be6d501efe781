"""The world's side: four tyres, each with a quarter of the weight, push along and are dragged across.

The tyres' forces are integrated implicitly, linear in the new speeds, as those of the shipped drives are.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tests.plugins.skid_steer.spec import WHEELS
from touchline.core.jit import kernel
from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.core.records import Record
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.world.body import STEP_S, BodyFigures, BodyState
from touchline.services.robot_sim.world.drives.tyres import ROLLING_MPS, stiffness
from touchline.services.robot_sim.world.drives.world_drive import WorldDrive
from touchline.services.robot_sim.world.effects import Effects
from touchline.services.robot_sim.world.lag import share_per_step

Floats = NDArray[np.float64]


class SkidSteerState(Record):
    """Of the wheels, in the order of the actuators."""

    rate_radps: Annotated[Floats, len(WHEELS)]


class TrueSkidSteer(NamedTuple):
    """Its figures, with what physics calls; x and y are half the wheelbase and half the track."""

    radius_m: float
    x_m: float
    y_m: float
    max_rate_radps: float
    max_step_radps: float
    lag: float

    @kernel
    def begin_tick(self, _own: SkidSteerState, _body: BodyFigures, _seed: int, _tick: int) -> None:
        """Nothing is random here."""

    @kernel
    def actuate(
        self, state: BodyState, own: SkidSteerState, body: BodyFigures, effects: Effects, commanded: Floats
    ) -> float:
        """The wheels follow by a first-order lag, as fast as what is left of their torque; it takes what rolls."""
        power = 0.0
        for wheel in range(len(commanded)):
            target = min(max(commanded[wheel], -self.max_rate_radps), self.max_rate_radps)
            most = self.max_step_radps * effects.torque_share[wheel]
            rate = own.rate_radps[wheel]
            rate += min(max((target - rate) * self.lag, -most), most)
            own.rate_radps[wheel] = 0.0 if effects.blocked[wheel] else rate
            state.angles_rad[wheel] += own.rate_radps[wheel] * STEP_S
            power += 0.25 * body.mass_kg * GRAVITY_MPS2 * body.rolling * self.radius_m * abs(own.rate_radps[wheel])
        return power

    @kernel
    def roll_on(
        self, state: BodyState, own: SkidSteerState, body: BodyFigures, effects: Effects, mass_kg: float
    ) -> None:
        """Forces at (x, y): along k·(rim − v + y·ω), across −q·(u + x·ω), v ahead, u to the left."""
        speed, side, yaw = state.speed_mps, state.side_speed_mps, state.yaw_rate_radps
        load = 0.25 * mass_kg * GRAVITY_MPS2 * state.up_z
        along, across, turned, crossed, lever = mass_kg / STEP_S, mass_kg / STEP_S, 0.0, 0.0, 0.0
        ahead = along * speed + mass_kg * (side * yaw - GRAVITY_MPS2 * state.up_x)
        left = across * side - mass_kg * (speed * yaw + GRAVITY_MPS2 * state.up_y)
        inertia = mass_kg * body.gyration_m2 / STEP_S
        turning = inertia * yaw
        for wheel in range(len(own.rate_radps)):
            x = self.x_m if wheel < 2 else -self.x_m
            y = self.y_m if wheel % 2 == 0 else -self.y_m
            rim = own.rate_radps[wheel] * self.radius_m * (1.0 - effects.slip[wheel])
            beneath = speed - y * yaw
            k, q = stiffness(rim, beneath, side + x * yaw, load, body)
            ahead += k * rim
            turning -= y * k * rim
            k += body.rolling * load / max(abs(beneath), ROLLING_MPS)
            along, across = along + k, across + q
            turned, crossed = turned + k * y, crossed + q * x
            lever += k * y * y + q * x * x
        # along·v − turned·ω = ahead, across·u + crossed·ω = left, −turned·v + crossed·u + (inertia + lever)·ω = turning
        turning += turned * ahead / along - crossed * left / across
        yaw = turning / (inertia + lever - turned * turned / along - crossed * crossed / across)
        state.yaw_rate_radps = yaw
        state.speed_mps, state.side_speed_mps = (ahead + turned * yaw) / along, (left - crossed * yaw) / across


class SkidSteerInWorld(WorldDrive):
    def __init__(self, vehicle: Vehicle, _scenario: Scenario) -> None:
        drive = vehicle.drive
        self.figures = TrueSkidSteer(
            drive.wheel_radius_m,
            0.5 * drive.wheelbase_m,
            0.5 * drive.track_width_m,
            drive.max_wheel_speed_radps,
            drive.max_wheel_acceleration_radps2 * STEP_S,
            share_per_step(drive.motor_time_constant_s),
        )
        self.state = SkidSteerState()

    def rest(self) -> None:
        self.state.reset()
