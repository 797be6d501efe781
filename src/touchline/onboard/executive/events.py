"""Events that the robot's computer reports to people."""

from __future__ import annotations

from typing import Final

from touchline.onboard.interface import OnboardEvent

INFO: Final = 0
WARN: Final = 1
ERROR: Final = 2


class EventLog:
    """Collection of events until they are taken."""

    def __init__(self) -> None:
        """Make an empty log."""
        self._events: list[OnboardEvent] = []

    def report(self, severity: int, code: str, text: str) -> None:
        """Add an event.

        Args:
            severity: INFO, WARN or ERROR.
            code: Machine-readable kind of the event.
            text: Description for people.
        """
        self._events.append(OnboardEvent(severity, code, text))

    @property
    def empty(self) -> bool:
        """True if nothing has happened since the last `take`."""
        return not self._events

    def take(self) -> list[OnboardEvent]:
        """Return and clear the events since the last call, oldest first."""
        events, self._events = self._events, []
        return events
