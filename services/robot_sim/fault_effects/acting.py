"""Time and place of an acting fault, as its function is given them beside the fault."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

from touchline.services.robot_sim.world.effects import Effects


class Acting(NamedTuple):
    """A fault that acts.

    Attributes:
        start_s: Sim time at which it began.
        actuators: Numbers of those that it is a fault of, if it is an `ActuatorFault`; else none.
    """

    start_s: float
    actuators: list[int]


class ApplyFault(Protocol):
    """The function of a kind of fault."""

    def __call__(self, fault: Any, effects: Effects, acting: Acting) -> None:
        """Add one acting fault to `effects`.

        Offsets add up, and else the worse of both counts: whichever fault comes first, the sum is the same.
        """
