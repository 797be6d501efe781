"""A drive of somebody else in the world: a driven drum and a steered wheel that never slip.

The drum's speed follows its command at once as far as its torque lets it, the steering at its rate: v = ω·r, and the
yaw rate is -v·tan δ / L. What is not blocked or slipping is exact, so circles are known.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tests.onboard.drum_onboard import OnboardDrum
from tests.planner.drum_drive import DrumDrive, PlannedDrum
from touchline.core.jit import kernel
from touchline.core.records import Record
from touchline.schemas.plugins import DRIVES, KindParts
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.world.body import STEP_S, BodyFigures, BodyState
from touchline.services.robot_sim.world.drives.world_drive import WorldDrive
from touchline.services.robot_sim.world.effects import Effects

Floats = NDArray[np.float64]


class DrumState(Record):
    rate_radps: float


class TrueDrum(NamedTuple):
    """Its figures, with what physics calls."""

    radius_m: float
    base_m: float
    max_rate_radps: float
    max_steering_rad: float
    max_steering_rate_radps: float

    @kernel
    def begin_tick(self, _own: DrumState, _body: BodyFigures, _seed: int, _tick: int) -> None:
        """Nothing is random here."""

    @kernel
    def actuate(
        self, state: BodyState, own: DrumState, _body: BodyFigures, effects: Effects, commanded: Floats
    ) -> float:
        rate = min(max(commanded[0] * effects.torque_share[0], -self.max_rate_radps), self.max_rate_radps)
        own.rate_radps = 0.0 if effects.blocked[0] else rate
        wanted = min(max(commanded[1], -self.max_steering_rad), self.max_steering_rad)
        most = 0.0 if effects.blocked[1] else self.max_steering_rate_radps * STEP_S
        state.angles_rad[1] += min(max(wanted - state.angles_rad[1], -most), most)
        return 50.0 * abs(own.rate_radps)

    @kernel
    def roll_on(self, state: BodyState, own: DrumState, _body: BodyFigures, effects: Effects, _mass_kg: float) -> None:
        state.angles_rad[0] += own.rate_radps * STEP_S
        state.speed_mps = own.rate_radps * self.radius_m * (1.0 - effects.slip[0])
        state.side_speed_mps = 0.0
        state.yaw_rate_radps = -state.speed_mps * math.tan(state.angles_rad[1]) / self.base_m


class DrumInWorld(WorldDrive):
    def __init__(self, vehicle: Vehicle, _scenario: Scenario) -> None:
        drive = vehicle.drive
        figures = drive.drum_radius_m, drive.wheelbase_m, drive.max_drum_speed_radps, drive.max_steering_rad
        self.figures = TrueDrum(*figures, drive.max_steering_rate_radps)
        self.state = DrumState()

    def rest(self) -> None:
        self.state.reset()


@contextmanager
def registered() -> Iterator[None]:
    """With the kind `drum` among the drives, that can be planned for, driven and emulated."""
    parts = KindParts(DrumDrive, planner=PlannedDrum, onboard=OnboardDrum, world=DrumInWorld)
    DRIVES.register("drum", "a driven drum and a steered wheel", parts)
    try:
        yield
    finally:
        DRIVES.forget("drum")
