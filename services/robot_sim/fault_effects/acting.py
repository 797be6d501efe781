"""Context of an acting fault, passed to its function beside the fault."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

from touchline.services.robot_sim.world.effects import Effects


class Acting(NamedTuple):
    """Start and actuators of an acting fault.

    Attributes:
        start_s: Sim time at which it began.
        actuators: Indices of the affected actuators of an `ActuatorFault`; otherwise empty.
    """

    start_s: float
    actuators: list[int]


class ApplyFault(Protocol):
    """Function of a kind of fault."""

    def __call__(self, fault: Any, effects: Effects, acting: Acting) -> None:
        """Add one acting fault to `effects`.

        Offsets add up; of other effects the worst one counts. So the order of the faults does not matter.

        Args:
            fault: The fault.
            effects: Sum of the acting faults, updated.
            acting: Its start and actuators.
        """
