"""Event log of bounded length."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

from touchline.schemas.plain_text import plain

INFO, WARN, ERROR = 0, 1, 2
CAPACITY = 1000


@dataclass(frozen=True)
class Entry:
    """Line of the log: sim time (None if unknown), severity, source, text, number of repeats.

    Entries that are `replayed` belong to the time of a recording.
    """

    time_s: float | None
    severity: int
    source: str
    text: str
    times: int = 1
    replayed: bool = False


class OperatorLog:
    """Last entries; `revision` changes with every one, `total` counts those that are not repeats."""

    def __init__(self) -> None:
        """Create an empty log."""
        self.entries: deque[Entry] = deque(maxlen=CAPACITY)
        self.total = 0
        self.revision = 0
        self.cuts = 0
        """Number of removals of entries from the middle."""
        self.last_warning: Entry | None = None
        """Last warning or error."""

    def forget_replayed(self) -> None:
        """Remove replayed entries."""
        kept = [entry for entry in self.entries if not entry.replayed]
        if len(kept) < len(self.entries):
            self.entries = deque(kept, maxlen=CAPACITY)
            warnings = [entry for entry in kept if entry.severity > INFO]
            self.last_warning = warnings[-1] if warnings else None
            self.cuts += 1
            self.revision += 1

    def add(self, time_s: float | None, severity: int, source: str, text: str, *, replayed: bool = False) -> None:
        """Append an entry, without control characters; a repeat of the last entry only counts there."""
        source, text = plain(source), plain(text)
        self.revision += 1
        if severity > INFO:
            self.last_warning = Entry(time_s, severity, source, text, replayed=replayed)
        last = self.entries[-1] if self.entries else None
        entry = (severity, source, text, replayed)
        if last and (last.severity, last.source, last.text, last.replayed) == entry:
            self.entries[-1] = replace(last, time_s=time_s, times=last.times + 1)
            return
        self.entries.append(Entry(time_s, severity, source, text, replayed=replayed))
        self.total += 1
