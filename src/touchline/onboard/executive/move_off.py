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
    """

    def __init__(self, limits: MoveOffLimits, vehicle: Vehicle) -> None:
        self.warning_ticks = math.ceil(limits.warning_s * TICKS_PER_S)
        self.start_warning_ticks = math.ceil(limits.start_warning_s * TICKS_PER_S)
        self.longest_stop_s = limits.person_after_s or (PERSON_AFTER_S if _hazardous(vehicle) else math.inf)

    def needs_person(self, since_tick: int, until_tick: int) -> bool:
        """Return True if a stop is too long to end by itself.

        Args:
            since_tick: First tick of the stop.
            until_tick: Its end.
        """
        return until_tick - since_tick > self.longest_stop_s * TICKS_PER_S


def _hazardous(vehicle: Vehicle) -> bool:
    """Return True if the robot could hurt a person who has come close to it meanwhile."""
    return vehicle.tool.kind != "none" or vehicle.mass_full_kg > LIGHT_KG
