"""What keeps a robot's loop safe: watchdog, link watch, and the guard of the emergency stop's latch."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any, Final

from touchline.bus import Bus
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.messages.base import Message
from touchline.services.robot_sim.command_handlers import Handler

GUARDIANS: Final = frozenset((topics.CONSOLE, topics.OPERATOR, topics.PLANNER, topics.COORDINATOR))
"""Of these nodes at least one must be on the bus while the robot drives by itself."""
WATCHDOG_S: Final = 0.2
"""Not commanded for so long in real time, valve and wheels stop by themselves."""
RESET_AFTER_S: Final = 0.5
"""A reset that comes sooner after an emergency stop was given before it, and is late: it must not undo the stop."""


class Watchdog:
    """For how long the loop had not turned, at each turn."""

    def __init__(self) -> None:
        """It has never turned."""
        self._turned_s: float | None = None

    def missed_s(self, now_s: float) -> float:
        """Since the last turn; this is one."""
        missed_s = now_s - self._turned_s if self._turned_s is not None else 0.0
        self._turned_s = now_s
        return missed_s


class LatchGuard:
    """Keeps a reset that was given before an emergency stop, and served after it, from undoing it."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """No stop yet."""
        self._clock = clock
        self._stopped_at_s = -math.inf

    def stop(self, handler: Handler) -> Handler:
        """The emergency stop's handler, watched."""

        def handle(request: Any) -> Message:
            self._stopped_at_s = self._clock()
            return handler(request)

        return handle

    def reset(self, handler: Handler) -> Handler:
        """The reset's handler, guarded."""

        def handle(request: Any) -> Message:
            since_s = self._clock() - self._stopped_at_s
            if since_s < RESET_AFTER_S:
                text = f"the emergency stop was given only {since_s:.1f} s ago; reset again if it is safe"
                return m.CommandResponse(success=False, message=text)
            return handler(request)

        return handle


class LinkWatch:
    """Whether everybody who could stop the robot has been gone for too long."""

    def __init__(self, bus: Bus, timeout_s: float) -> None:
        """Watch the bus."""
        self._presence = bus.presence()
        self._timeout_s = timeout_s
        self._seen_s: float | None = None

    def lost(self, driving: bool, now_s: float) -> bool:
        """True when `driving` and no guardian has been there for the time-out, counted from the start of driving."""
        self._presence.poll()
        if not driving or self._seen_s is None or GUARDIANS & self._presence.alive():
            self._seen_s = now_s
        return now_s - self._seen_s > self._timeout_s
