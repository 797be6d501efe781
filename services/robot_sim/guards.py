"""Guards of a robot's loop: watchdog, link watch, and the guard of the emergency stop's latch."""

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
"""Nodes of which at least one must be on the bus while the robot drives by itself."""
OPERATORS: Final = frozenset((topics.CONSOLE, topics.OPERATOR))
"""Nodes of people who watch a robot."""
WATCHDOG_S: Final = 0.2
"""Real time without a command after which valve and wheels stop by themselves."""
RESET_AFTER_S: Final = 0.5
"""Time after an emergency stop within which a reset was given before it, and is late: it must not undo the stop."""


class Watchdog:
    """Meter of the time between turns of the loop."""

    def __init__(self) -> None:
        """Begin before the first turn."""
        self._turned_s: float | None = None

    def missed_s(self, now_s: float) -> float:
        """Return the time since the last turn, and count this one."""
        missed_s = now_s - self._turned_s if self._turned_s is not None else 0.0
        self._turned_s = now_s
        return missed_s


class LatchGuard:
    """Guard against a reset that was given before an emergency stop, and served after it."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Begin without a stop."""
        self._clock = clock
        self._stopped_at_s = -math.inf

    def stop(self, handler: Handler) -> Handler:
        """Wrap the emergency stop's handler to record its time."""

        def handle(request: Any) -> Message:
            self._stopped_at_s = self._clock()
            return handler(request)

        return handle

    def reset(self, handler: Handler) -> Handler:
        """Wrap the reset's handler to refuse late resets."""

        def handle(request: Any) -> Message:
            since_s = self._clock() - self._stopped_at_s
            if since_s < RESET_AFTER_S:
                text = f"the emergency stop was given only {since_s:.1f} s ago; reset again if it is safe"
                return m.CommandResponse(success=False, message=text)
            return handler(request)

        return handle


class LinkWatch:
    """Monitor of the nodes that could stop the robot."""

    def __init__(self, bus: Bus, timeout_s: float) -> None:
        """Watch the bus."""
        self._presence = bus.presence()
        self._timeout_s = timeout_s
        self._seen_s: float | None = None

    @property
    def attended(self) -> bool:
        """True if an operator is on the bus who could answer, as of the last call of `lost`."""
        return bool(OPERATORS & self._presence.alive())

    def lost(self, driving: bool, now_s: float) -> bool:
        """Return True if the robot drives and no guardian has been there for the time-out.

        Args:
            driving: True while the robot drives; the time-out is counted from its start.
            now_s: Monotonic wall time.
        """
        self._presence.poll()
        there = self._presence.linked and GUARDIANS & self._presence.alive()
        if not driving or self._seen_s is None or there:
            self._seen_s = now_s
        return now_s - self._seen_s > self._timeout_s
