"""Patience: how long a robot on a job may stand before the job counts as stalled, by what the robot reports."""

from __future__ import annotations

import math
import time
from typing import Final

from touchline.schemas.messages import PauseStatus, TraversalStatus

STALLED_S: Final = 20.0
"""Wall clock: a robot that has not moved for this long, and waits for nobody, will not finish by itself."""
ENDS_BY_ITSELF_S: Final = 180.0
"""The same for one that reports that its pause ends by itself."""


def waits_for_operator(status: TraversalStatus, pause: PauseStatus) -> bool:
    """Whether an operator has paused the robot, so that it stands until an operator resumes it, however long."""
    return status.state == TraversalStatus.PAUSED and pause.cause == PauseStatus.OPERATOR


class Patience:
    """Tells when a robot has stood for too long; call `stalled` with every look at it."""

    def __init__(self) -> None:
        """It has just moved."""
        self._since_s, self._seen = time.monotonic(), (-1.0, STALLED_S)

    def stalled(self, status: TraversalStatus, pause: PauseStatus) -> str:
        """Why the robot counts as stalled; "" as long as it does not."""
        longest_s = _longest_s(status, pause)
        seen, now_s = (status.arc_length_m, longest_s), time.monotonic()
        if seen != self._seen:
            self._since_s, self._seen = now_s, seen
        if now_s - self._since_s <= longest_s:
            return ""
        return f"the robot has not moved for {longest_s:.0f} s ({status.reason or 'no reason given'})"


def _longest_s(status: TraversalStatus, pause: PauseStatus) -> float:
    if waits_for_operator(status, pause):
        return math.inf
    paused = status.state == TraversalStatus.PAUSED
    return ENDS_BY_ITSELF_S if paused and pause.ends_by_itself else STALLED_S
