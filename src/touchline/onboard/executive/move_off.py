"""Move-off rules: duration of the warning before the robot moves off, and longest stop that it ends by itself."""

from __future__ import annotations

import math
from typing import Final

from touchline.onboard.interface import TICKS_PER_S
from touchline.schemas.onboard import MoveOffLimits
from touchline.schemas.vehicles import Vehicle

PERSON_AFTER_S: Final = 30.0
"""Longest stop that a robot with a tool, or a heavy one, ends by itself, unless the configuration sets another."""
LIGHT_KG: Final = 20.0
"""Largest mass at which a robot without a tool ends any stop by itself."""


class MoveOffRules:
    """Rules for one robot.

    Args:
        limits: Limits of its configuration.
        vehicle: Vehicle whose tool and mass decide if the configuration does not.

    Attributes:
        warning_ticks: After a pause, ticks from the start of the warning to the first in which the robot may move.
        start_warning_ticks: The same after a start.
        longest_stop_s: Longest stop that the robot ends by itself; infinite if there is no limit.
        longest_wait_s: The same for a stop because of something in the way. Unless the configuration sets one, there is
            no limit for a robot that sees all round: nobody can have come close to it unseen.
    """

    def __init__(self, limits: MoveOffLimits, vehicle: Vehicle, *, watches_all_round: bool = False) -> None:
        self.warning_ticks = math.ceil(limits.warning_s * TICKS_PER_S)
        self.start_warning_ticks = math.ceil(limits.start_warning_s * TICKS_PER_S)
        self.longest_stop_s = limits.person_after_s or (PERSON_AFTER_S if _hazardous(vehicle) else math.inf)
        self.longest_wait_s = limits.person_after_s or (math.inf if watches_all_round else self.longest_stop_s)

    def longest_s(self, *, waits: bool) -> float:
        """Return the longest stop that the robot ends by itself [s].

        Args:
            waits: True for a stop because of something in the way.
        """
        return self.longest_wait_s if waits else self.longest_stop_s


def _hazardous(vehicle: Vehicle) -> bool:
    """Return True if the robot could hurt a person who has come close to it meanwhile."""
    return vehicle.tool.kind != "none" or vehicle.mass_full_kg > LIGHT_KG
