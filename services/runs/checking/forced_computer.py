"""The robot's computer of today on what was recorded: it decides, but the actuators do what they did then.

So world and sensors are as they were, whatever the computer of today would do, and what differs first tells which part
has changed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.setup import Setup
from touchline.services.onboard import Onboard
from touchline.services.onboard.interface import Command


class ForcedComputer(Onboard):
    """See the module.

    Args:
        setup: The robot and its world.
        forced: (n, ACTUATORS) what the actuators do in each tick; NaN where the computer itself decides.

    Attributes:
        decided: Its own decisions, by tick.
    """

    def __init__(self, setup: Setup, forced: NDArray[np.float64]) -> None:
        super().__init__(setup.vehicle, setup.onboard)
        self._forced = forced
        self.decided: dict[int, tuple[float, ...]] = {}

    def decide(self, tick: int) -> Command:
        """See `Onboard`; the next tick takes what was recorded for its own last decision."""
        own = super().decide(tick)
        self.decided[tick] = own.actuators
        if tick >= len(self._forced) or np.isnan(self._forced[tick]).any():
            return own
        return self._state.command.give(own._replace(actuators=tuple(self._forced[tick].tolist())))
