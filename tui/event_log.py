"""Bounded list of the event log's entries."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

from touchline.schemas.plain_text import plain

INFO, WARN, ERROR = 0, 1, 2
CAPACITY = 1000


@dataclass(frozen=True)
class Entry:
    """One line of the log: sim time (None when unknown), severity, who says it, what, and how often in a row."""

    time_s: float | None
    severity: int
    source: str
    text: str
    times: int = 1


class OperatorLog:
    """The last entries; `revision` changes with every one, `total` counts those that are not repeats."""

    def __init__(self) -> None:
        """An empty log."""
        self.entries: deque[Entry] = deque(maxlen=CAPACITY)
        self.total = 0
        self.revision = 0
        self.last_warning: Entry | None = None
        """The last warning or error."""

    def add(self, time_s: float | None, severity: int, source: str, text: str) -> None:
        """Append an entry, without what could command a terminal; a mere repeat of the last is counted on that."""
        source, text = plain(source), plain(text)
        self.revision += 1
        if severity > INFO:
            self.last_warning = Entry(time_s, severity, source, text)
        last = self.entries[-1] if self.entries else None
        if last and (last.severity, last.source, last.text) == (severity, source, text):
            self.entries[-1] = replace(last, time_s=time_s, times=last.times + 1)
            return
        self.entries.append(Entry(time_s, severity, source, text))
        self.total += 1
