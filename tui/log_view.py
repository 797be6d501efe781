"""The event log: sim time, a mark and a colour by severity, who says it, and what."""

from __future__ import annotations

from rich.table import Table
from rich.text import Text
from textual import events
from textual.widgets import RichLog

from tui import format, theme
from tui.event_log import INFO, Entry, EventLog

ROOMY = 64
"""From this width on there is room for who says it."""


def line(entry: Entry, width: int) -> Table:
    """An entry as it is shown, long text wrapped beside its time."""
    badge = theme.SEVERITIES[min(max(entry.severity, 0), len(theme.SEVERITIES) - 1)]
    time = format.duration(entry.time_s) if entry.time_s is not None else "–:––"
    text = Text(entry.text, style=theme.INK if entry.severity == INFO else f"bold {badge.color}")
    if entry.times > 1:
        text.append(f"  ×{entry.times}", style=theme.MUTED)
    grid = Table.grid(padding=(0, 1, 0, 0), expand=True)
    grid.add_column(width=7, justify="right", style=theme.MUTED)
    grid.add_column(width=1, style=badge.color)
    cells: list[Text | str] = [time, badge.mark]
    if width >= ROOMY:
        grid.add_column(width=10, style=theme.MUTED, no_wrap=True)
        cells.append(entry.source)
    grid.add_column(ratio=1)
    grid.add_row(*cells, text)
    return grid


class LogView(RichLog):
    """The last events, the newest at the bottom."""

    def __init__(self, *, id: str | None = None) -> None:
        """An empty log."""
        super().__init__(id=id, wrap=True, markup=False, max_lines=2000, min_width=20)
        self.border_title = "Events"
        self._events = EventLog()
        self._revision = 0
        self._total = 0
        self._width = 0

    def show(self, log: EventLog) -> None:
        """Write what is new; a repeat of the last entry rewrites the log, to count it there."""
        self._events = log
        if log.revision == self._revision or not self._width:
            return
        fresh = log.total - self._total
        if fresh == log.revision - self._revision and fresh <= len(log.entries):
            for entry in list(log.entries)[-fresh:]:
                self._write(entry)
        else:
            self._rewrite()
        self._revision, self._total = log.revision, log.total

    def _write(self, entry: Entry) -> None:
        self.write(line(entry, self._width), width=self._width)

    def _rewrite(self) -> None:
        self.clear()
        for entry in self._events.entries:
            self._write(entry)

    def on_resize(self, event: events.Resize) -> None:
        """Wrap the lines anew."""
        width = self.scrollable_content_region.width
        if width != self._width:
            self._width = width
            self._rewrite()
            self._revision, self._total = self._events.revision, self._events.total
