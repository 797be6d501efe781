"""Late robots, which lockstep no longer waits for: reported at beginning and end, and counted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from typing import Final, Protocol

from touchline.coordination.guidance_messages import header_at
from touchline.schemas import messages as m
from touchline.schemas import topics

NOT_WAITED_FOR: Final = "not-waited-for"
WAITED_FOR_AGAIN: Final = "waited-for-again"


class MessageProgress(Protocol):
    """Progress of a robot's messages."""

    def has_reported(self, tick: int) -> bool:
        """Return whether it has reported a tick."""


class LateRobots:
    """Register of late robots.

    Args:
        report: Takes events for people.
        silent_s: Wall-clock time of silence after which a robot is no longer waited for.

    Attributes:
        exchanges: By robot, number of exchanges made without it.
    """

    def __init__(self, report: Callable[[m.Event], object], silent_s: float) -> None:
        self._report, self._silent_s = report, silent_s
        self.exchanges: Counter[str] = Counter()
        self._now: set[str] = set()

    def look(self, tick: int, lines: Mapping[str, MessageProgress]) -> None:
        """Note the robots that have not reported a tick at which messages are exchanged all the same."""
        late = {name for name, line in lines.items() if not line.has_reported(tick)}
        self.exchanges.update(late)
        for name in sorted(late - self._now):
            text = (
                f"{name} has been silent for {self._silent_s:g} s (wall clock) and is not waited for: the sessions of "
                "the team may differ from those of `touchline fleet simulate` from here on"
            )
            self._event(tick, m.Event.WARN, NOT_WAITED_FOR, text)
        for name in sorted((self._now - late) & lines.keys()):
            self._event(tick, m.Event.INFO, WAITED_FOR_AGAIN, f"{name} is heard, and waited for again")
        self._now = late

    def _event(self, tick: int, severity: int, code: str, text: str) -> None:
        header = header_at(tick)
        self._report(m.Event(header=header, severity=severity, source=topics.COORDINATOR, code=code, text=text))
