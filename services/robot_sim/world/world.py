"""The true robot: state, constants and the step from one onboard tick to the next."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.onboard.interface import Command
from touchline.services.robot_sim.world import body, physics
from touchline.services.robot_sim.world.constants import constants
from touchline.services.robot_sim.world.effects import neutral

NO_EFFECTS: Final = neutral()
_AT_REST: Final = [
    *(body.LEFT_RATE, body.RIGHT_RATE, body.SPEED, body.YAW_RATE, body.SIDE_SPEED),
    *(body.REFERENCE, body.REFERENCE + 1, body.TORQUE, body.TORQUE + 1, body.INTEGRAL, body.INTEGRAL + 1),
]


class TruePose(NamedTuple):
    """Axle centre and heading in the map frame; the heading is not wrapped."""

    east_m: float
    north_m: float
    heading_rad: float


class World:
    """What is true about the robot and its consumables.

    Args:
        vehicle: The nominal robot.
        scenario: Seed, ground, errors of the chassis and slip; `effective()` is taken here.

    Attributes:
        state: (body.STATE_SIZE,) the truth, indexed by the constants of `body`.
        trace: body.TRACE_SHAPE, the nozzle during the last tick.
        parameters: (body.PARAMETER_SIZE,) the world's constants.
    """

    def __init__(self, vehicle: Vehicle, scenario: Scenario) -> None:
        self.state: NDArray[np.float64] = np.zeros(body.STATE_SIZE)
        self.trace: NDArray[np.float64] = np.zeros(body.TRACE_SHAPE)
        self.parameters = constants(vehicle, scenario.effective())
        self._seed = scenario.seed
        self._full_l, self._full_wh = vehicle.tool.tank_l, vehicle.body.battery_wh
        self.refill_tank()
        self.replace_battery()
        self.place(TruePose(0.0, 0.0, 0.0))

    @property
    def pose(self) -> TruePose:
        """Where the robot truly is."""
        return TruePose(*self.state[body.EAST : body.HEADING + 1].tolist())

    @property
    def supplies(self) -> tuple[float, float, float, float]:
        """What is left of paint [l] and charge [Wh], then what faults keep from use of either."""
        tank_l, battery_wh = self.state[body.TANK_L : body.BATTERY_WH + 1].tolist()
        tank_reserve_l, battery_reserve_wh = self.state[body.TANK_RESERVE_L : body.BATTERY_RESERVE_WH + 1].tolist()
        return tank_l, battery_wh, tank_reserve_l, battery_reserve_wh

    def supply(self, supplies: tuple[float, float, float, float]) -> None:
        """Have these, as `supplies` gives them."""
        self.state[body.TANK_L : body.BATTERY_WH + 1] = supplies[:2]
        self.state[body.TANK_RESERVE_L : body.BATTERY_RESERVE_WH + 1] = supplies[2:]

    def refill_tank(self) -> None:
        """Fill the tank; a fault that keeps paint from use goes on doing so."""
        self.state[body.TANK_L], self.state[body.TANK_RESERVE_L] = self._full_l, 0.0

    def replace_battery(self) -> None:
        """Have a full battery, as `refill_tank`."""
        self.state[body.BATTERY_WH], self.state[body.BATTERY_RESERVE_WH] = self._full_wh, 0.0

    def place(self, pose: TruePose) -> None:
        """Put the robot at rest at `pose`, as if carried there; tank, battery and wheel angles stay."""
        self.state[body.EAST], self.state[body.NORTH], self.state[body.HEADING] = pose
        self.state[_AT_REST] = 0.0
        self.state[body.CASTER_X], self.state[body.CASTER_Y] = 1.0, 0.0
        physics.tilt(self.state, self.parameters)

    def step(self, command: Command, tick: int, effects: NDArray[np.float64] = NO_EFFECTS) -> None:
        """Advance by one onboard tick under `command` and the `effects` of faults; `tick` keys the randomness."""
        physics.advance(
            self.state, self.parameters, *command.actuators, *command[1:], effects, self._seed, tick, self.trace
        )
