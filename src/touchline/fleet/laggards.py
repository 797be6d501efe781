"""Robots that are waited for no more in lockstep: told when it begins and when it ends, and counted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from typing import Final, Protocol

from touchline.fleet.answers import header_at
from touchline.schemas import messages as m
from touchline.schemas import topics

NOT_WAITED_FOR: Final = "not-waited-for"
WAITED_FOR_AGAIN: Final = "waited-for-again"


class HeardLine(Protocol):
    """What has to be known of a robot."""

    def has_told(self, tick: int) -> bool:
        """Whether it has told of a tick."""


class Laggards:
    """See the module.

    Args:
        tell: Takes what people should know.
        silent_s: Wall time for which a robot has said nothing when it is waited for no more.

    Attributes:
        exchanges: By robot, how many were made without it.
    """

    def __init__(self, tell: Callable[[m.Event], object], silent_s: float) -> None:
        self._tell, self._silent_s = tell, silent_s
        self.exchanges: Counter[str] = Counter()
        self._now: set[str] = set()

    def look(self, tick: int, lines: Mapping[str, HeardLine]) -> None:
        """Note who has not told of a tick at which messages are exchanged all the same."""
        late = {name for name, line in lines.items() if not line.has_told(tick)}
        self.exchanges.update(late)
        for name in sorted(late - self._now):
            text = (
                f"{name} has said nothing for {self._silent_s:g} s (wall clock) and is not waited for: the sessions of "
                "the team may differ from those of `touchline fleet simulate` from here on"
            )
            self._event(tick, m.Event.WARN, NOT_WAITED_FOR, text)
        for name in sorted((self._now - late) & lines.keys()):
            self._event(tick, m.Event.INFO, WAITED_FOR_AGAIN, f"{name} is heard, and waited for again")
        self._now = late

    def _event(self, tick: int, severity: int, code: str, text: str) -> None:
        header = header_at(tick)
        self._tell(m.Event(header=header, severity=severity, source=topics.COORDINATOR, code=code, text=text))
