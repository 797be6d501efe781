"""Limit of sim time for a recorder that cannot take telemetry as fast as the emulation makes it."""

from __future__ import annotations

import time
from typing import Final

from touchline.bus import Bus
from touchline.schemas import topics
from touchline.schemas.messages import Clock

FRESH_S: Final = 1.0
"""Validity of a limit: a recorder that is behind repeats it more often, and one that has died or hangs stops nobody for
longer."""
_LOOK_S: Final = 0.02


class RecorderLimit:
    """The last limit of sim time that the recorder has set; it is only checked at a pace that can be held back."""

    def __init__(self, bus: Bus) -> None:
        """Subscribe on the bus of the robot."""
        self._inbox = bus.inbox([topics.RECORDER_LIMIT], keep="latest")
        self._limit_s = self._heard_s = self._look_at_s = float("-inf")

    def passed(self, time_s: float) -> bool:
        """Return True if a sim time (s) lies beyond the limit."""
        now_s = time.monotonic()
        if now_s >= self._look_at_s:
            self._look_at_s = now_s + _LOOK_S
            for _, message in self._inbox.messages():
                assert isinstance(message, Clock)
                self._limit_s, self._heard_s = message.clock.seconds, now_s
        return now_s - self._heard_s < FRESH_S and time_s > self._limit_s
