"""The true robot: state, constants and the step from one onboard tick to the next."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.random import STREAM_WANDER, normal
from touchline.onboard.interface import Command, standstill
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.world import body, physics
from touchline.services.robot_sim.world.constants import constants
from touchline.services.robot_sim.world.drives.world_drive import world_drive
from touchline.services.robot_sim.world.effects import Effects
from touchline.services.robot_sim.world.objects.surroundings import Surroundings
from touchline.services.robot_sim.world.patches import patches_of
from touchline.services.robot_sim.world.roughness import shape_of
from touchline.services.robot_sim.world.tools.world_tool import world_tool

_TURN_ON_TICK = -1  # stands for a tick in numbers that are drawn once


class TruePose(NamedTuple):
    """Body's origin and heading in the map frame; the heading is not wrapped."""

    east_m: float
    north_m: float
    heading_rad: float


def held(command: Command) -> physics.HeldCommand:
    """Convert a command for kernels."""
    actuators, valve, disc, valve_after_s = command
    return physics.HeldCommand(np.array(actuators, dtype=np.float64), valve, disc, valve_after_s)


class World:
    """True state of the robot and its consumables.

    Args:
        vehicle: The real robot, of `true_vehicle`.
        scenario: Seed, ground, errors of the chassis and slip; its `effective()` form is used.

    Attributes:
        state: True state of the body.
        drive: True state of the drive: its `WorldDrive.state`.
        trace: body.TRACE_SHAPE, the tool's point during the last tick.
        figures: Constants.
        no_effects: Effects without faults.
        surroundings: Objects and obstacles around it.

    Raises:
        SpecError: The vehicle's drive or tool cannot be emulated.
    """

    def __init__(self, vehicle: Vehicle, scenario: Scenario) -> None:
        scenario = scenario.effective()
        self._drive = world_drive(vehicle, scenario)
        self._sees = bool(vehicle.sensors)
        self._count = len(vehicle.drive.actuators)
        self.state = body.BodyState.sized(self._count)()
        self.no_effects = Effects.sized(self._count)()
        self.drive: Any = self._drive.state
        self.trace: NDArray[np.float64] = np.zeros(body.TRACE_SHAPE)
        self.figures = physics.WorldFigures(
            constants(vehicle, scenario),
            self._drive.figures,
            world_tool(vehicle).figures,
            shape_of(scenario.ground, scenario.seed),
            patches_of(scenario.truth, scenario.seed),
        )
        self.state.wander_rad = scenario.truth.wander_rad * normal(scenario.seed, STREAM_WANDER, _TURN_ON_TICK, 0)
        self.surroundings = Surroundings(vehicle, scenario, self._drive.centre_x_m)
        self._seed = scenario.seed
        self._full_l, self._full_wh = vehicle.tool.capacity_l, vehicle.body.battery_wh
        self.refill_tank()
        self.replace_battery()
        if scenario.charge < 1.0:
            self.state.battery_wh = scenario.charge * self._full_wh
        self.place(TruePose(0.0, 0.0, 0.0))

    @property
    def arrays(self) -> physics.WorldArrays:
        """State and constants, for `physics.advance`."""
        things = self.surroundings.things
        return physics.WorldArrays(self.figures, self.state.array, self.drive.array, self.trace, self._seed, things)

    @property
    def pose(self) -> TruePose:
        """True pose of the robot."""
        state = self.state
        return TruePose(state.east_m, state.north_m, state.heading_rad)

    @property
    def own_arrays(self) -> dict[str, NDArray[np.float64]]:
        """Arrays of its state that are no records, by name: views."""
        things, found = self.surroundings.things, {"trace": self.trace}
        if len(things.movers):
            found["movers"] = things.movers
        if self._sees:
            found["trail"] = things.trail
        return found

    @property
    def supplies(self) -> tuple[float, float, float, float]:
        """Paint [l] and charge [Wh], then the parts of both that faults withhold."""
        state = self.state
        return state.tank_l, state.battery_wh, state.tank_reserve_l, state.battery_reserve_wh

    def supply(self, supplies: tuple[float, float, float, float]) -> None:
        """Set paint and charge, as `supplies` returns them."""
        state = self.state
        state.tank_l, state.battery_wh, state.tank_reserve_l, state.battery_reserve_wh = supplies

    def refill_tank(self) -> None:
        """Fill the tank; a fault that withholds paint continues to do so."""
        self.state.tank_l, self.state.tank_reserve_l = self._full_l, 0.0

    def replace_battery(self) -> None:
        """Replace the battery by a full one, as `refill_tank`."""
        self.state.battery_wh, self.state.battery_reserve_wh = self._full_wh, 0.0

    def place(self, pose: TruePose) -> None:
        """Put the robot at rest at `pose`, as if carried there; tank, battery and wheel angles stay."""
        state = self.state
        state.east_m, state.north_m, state.heading_rad = pose
        state.speed_mps = state.side_speed_mps = state.yaw_rate_radps = state.climb_mps = 0.0
        self._drive.rest()
        physics.tilt(state.array[0], self.figures.body, self.figures.waves)
        self.surroundings.carry(pose)

    def step(self, command: Command, tick: int, effects: Effects | None = None) -> None:
        """Advance by one onboard tick.

        Args:
            command: Command in force.
            tick: The tick, which keys the randomness.
            effects: Effects of faults; None: there are none.
        """
        self._advance(self.arrays, held(command), (effects or self.no_effects).array, tick)

    @cached_property
    def _advance(self) -> Callable[..., None]:
        """The kernel `physics.advance`, without checking the types of its arguments, which are always the same."""
        arguments = self.arrays, held(standstill(self._count)), self.no_effects.array, 0
        code: Callable[..., None] = physics.advance.for_types_of(arguments)
        return code
