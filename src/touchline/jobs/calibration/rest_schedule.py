"""Rests of a robot under way: it is authorized to drive up to each in turn, and stands there for a while."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from touchline.services.planner.calibration_drive import PlannedRest

_THERE_M: Final = 0.02
"""Distance to a rest within which a robot that stands has come to it."""
_STILL_MPS: Final = 0.02
_STILL_RADPS: Final = 0.02


class RestSchedule:
    """Schedule of a robot's rests.

    Args:
        rests: Rests in their order.
    """

    def __init__(self, rests: Sequence[PlannedRest]) -> None:
        self._rests = list(rests)
        self._since_s = math.inf

    @property
    def until_m(self) -> float:
        """Arc length up to which the robot may drive now; infinite after the last rest."""
        return self._rests[0].at_m if self._rests else math.inf

    def look(self, time_s: float, arc_length_m: float, speed_mps: float, yaw_rate_radps: float) -> bool:
        """Return whether the robot has rested for long enough, and may drive up to another `until_m`.

        Args:
            time_s: Sim time.
            arc_length_m: Arc length that the robot has come to.
            speed_mps: Its speed.
            yaw_rate_radps: Its yaw rate.
        """
        still = abs(speed_mps) < _STILL_MPS and abs(yaw_rate_radps) < _STILL_RADPS
        if not self._rests or not still or arc_length_m < self.until_m - _THERE_M:
            self._since_s = math.inf
            return False
        self._since_s = min(self._since_s, time_s)
        if time_s - self._since_s < self._rests[0].time_s:
            return False
        self._rests.pop(0)
        self._since_s = math.inf
        return True
