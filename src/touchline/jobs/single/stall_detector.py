"""Stall detection: how long a robot on a job may stand, depending on what it reports."""

from __future__ import annotations

import math
import time
from typing import Final

from touchline.schemas.messages import PauseStatus, TraversalStatus

STALLED_S: Final = 20.0
"""Wall-clock time without motion after which a robot that waits for nobody will not finish by itself."""
ENDS_BY_ITSELF_S: Final = 180.0
"""The same for a robot that reports that its pause ends by itself."""
ADVANCED_M: Final = 0.05
"""Way along its path up to which a robot counts as standing: its estimate moves by centimetres while it stands."""


def waits_for_operator(status: TraversalStatus, pause: PauseStatus) -> bool:
    """Return whether an operator has paused the robot, so that it stands until it is resumed, however long."""
    return status.state == TraversalStatus.PAUSED and pause.cause == PauseStatus.OPERATOR


class StallDetector:
    """Detector of robots that stand for too long; call `stalled` at every poll."""

    def __init__(self) -> None:
        """Start as if it had just moved."""
        self._since_s, self._reached_m, self._longest_s = time.monotonic(), -1.0, STALLED_S

    def stalled(self, status: TraversalStatus, pause: PauseStatus) -> str:
        """Return why the robot counts as stalled; "" as long as it does not."""
        longest_s = _longest_s(status, pause)
        now_s = time.monotonic()
        if abs(status.arc_length_m - self._reached_m) > ADVANCED_M or longest_s != self._longest_s:
            self._since_s, self._reached_m, self._longest_s = now_s, status.arc_length_m, longest_s
        if now_s - self._since_s <= longest_s:
            return ""
        return f"the robot has not moved for {longest_s:.0f} s ({status.reason or 'no reason given'})"


def _longest_s(status: TraversalStatus, pause: PauseStatus) -> float:
    if waits_for_operator(status, pause):
        return math.inf
    paused = status.state == TraversalStatus.PAUSED
    return ENDS_BY_ITSELF_S if paused and pause.ends_by_itself else STALLED_S
