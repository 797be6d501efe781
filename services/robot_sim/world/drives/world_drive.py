"""What the world asks of a drive, whatever its kind."""

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
    """The drive of a vehicle in its world. Made of a `Vehicle` and an effective `Scenario`.

    Attributes:
        figures: What is constant about it, a named tuple whose class has the kernels `begin_tick`, `actuate` and
            `roll_on` below.
        state: What is true about it beyond the body's state.
    """

    figures: Any
    state: Record

    @abstractmethod
    def rest(self) -> None:
        """Put its state at rest; the angles of the actuators, which are the body's, stay."""


def world_drive(vehicle: Vehicle, scenario: Scenario) -> WorldDrive:
    """That of a vehicle, by the kind of its drive; `scenario` must be effective.

    Raises:
        SpecError: The kind cannot be emulated.
    """
    made: WorldDrive = part_for(DRIVES, vehicle.drive.kind, "world")(vehicle, scenario)
    return made


@kernel_of_class
def begin_tick(drive: Any, own: Any, body: BodyFigures, seed: int, tick: int) -> None:
    """Draw what changes at random once a tick.

    Args:
        drive: The `WorldDrive.figures`.
        own: The `WorldDrive.state`, to change.
        body: Figures of the body on its ground.
        seed: Of the scenario; keys the randomness together with:
        tick: Onboard tick that begins.
    """


@kernel_of_class
def actuate(  # type: ignore[empty-body]
    drive: Any, state: BodyState, own: Any, body: BodyFigures, effects: Effects, commanded: Floats
) -> float:
    """Let the actuators follow their commands for one physics step, in place.

    Args:
        drive: The `WorldDrive.figures`.
        state: The body's; the actuators' angles are the drive's to change.
        own: The `WorldDrive.state`, to change.
        body: Figures of the body on its ground.
        effects: What faults do: of each actuator the torque that is left.
        commanded: (actuators,), in the units of `DriveSpec.actuators`.

    Returns:
        The electrical power that they draw [W].
    """


@kernel_of_class
def roll_on(drive: Any, state: BodyState, own: Any, body: BodyFigures, effects: Effects, mass_kg: float) -> None:
    """Advance the body's speeds and the actuators' angles by one physics step, in place.

    Args:
        drive: The `WorldDrive.figures`.
        state: The body's; its speeds, yaw rate and the actuators' angles are the drive's to change.
        own: The `WorldDrive.state`, to change.
        body: Figures of the body on its ground.
        effects: What faults do: whether each actuator is blocked, and its slip.
        mass_kg: Of the whole robot.
    """
