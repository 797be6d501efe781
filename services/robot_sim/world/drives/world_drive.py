"""Interface of a drive in the world, whatever its kind."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel_of_class
from touchline.core.records import Record
from touchline.schemas.plugins import DRIVES, part_for
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.world.body import BodyFigures, BodyState
from touchline.services.robot_sim.world.effects import Effects

Floats = NDArray[np.float64]


class WorldDrive(ABC):
    """The drive of a vehicle in its world, made of a `Vehicle` and an effective `Scenario`.

    Attributes:
        figures: Constants of the drive, a named tuple whose class has the kernels `begin_tick`, `actuate` and `roll_on`
            below.
        state: True state of the drive beyond the body's.
        centre_x_m: Centre of mass ahead of the body's origin.
    """

    figures: Any
    state: Record
    centre_x_m: float = 0.0

    @abstractmethod
    def rest(self) -> None:
        """Put its state at rest; the angles of the actuators, which are the body's, stay."""


def world_drive(vehicle: Vehicle, scenario: Scenario) -> WorldDrive:
    """Make the drive of a vehicle, by its kind.

    Args:
        vehicle: The vehicle.
        scenario: The scenario, which must be effective.

    Raises:
        SpecError: The kind cannot be emulated.
    """
    made: WorldDrive = part_for(DRIVES, vehicle.drive.kind, "world")(vehicle, scenario)
    return made


@kernel_of_class
def begin_tick(drive: Any, own: Any, body: BodyFigures, seed: int, tick: int) -> None:
    """Draw the quantities that change at random once a tick.

    Args:
        drive: The `WorldDrive.figures`.
        own: The `WorldDrive.state`, to change.
        body: Constants of the body on its ground.
        seed: Seed of the scenario; keys the randomness together with:
        tick: Onboard tick that begins.
    """


@kernel_of_class
def actuate(  # type: ignore[empty-body]
    drive: Any, state: BodyState, own: Any, body: BodyFigures, effects: Effects, commanded: Floats
) -> float:
    """Let the actuators follow their commands for one physics step, in place.

    Args:
        drive: The `WorldDrive.figures`.
        state: State of the body; the actuators' angles may be changed.
        own: The `WorldDrive.state`, to change.
        body: Constants of the body on its ground.
        effects: Effects of faults: share of the torque of each actuator.
        commanded: (actuators,), in the units of `DriveSpec.actuators`.

    Returns:
        Electrical power that they draw [W].
    """


@kernel_of_class
def roll_on(drive: Any, state: BodyState, own: Any, body: BodyFigures, effects: Effects, mass_kg: float) -> None:
    """Advance the body's speeds and the actuators' angles by one physics step, in place.

    Args:
        drive: The `WorldDrive.figures`.
        state: State of the body; its speeds, yaw rate and the actuators' angles may be changed.
        own: The `WorldDrive.state`, to change.
        body: Constants of the body on its ground.
        effects: Effects of faults: blocked actuators, and slip of each.
        mass_kg: Mass of the whole robot.
    """
