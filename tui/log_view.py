"""View of the event log: sim time, mark and colour by severity, source, and text.

Only the lines in view are drawn, and an entry that repeats costs one line: a thousand entries are as quick as ten.
"""

from __future__ import annotations

from bisect import bisect_right
from textwrap import wrap
from typing import NamedTuple

from rich.segment import Segment
from rich.style import Style
from textual import events
from textual.geometry import Size
from textual.scroll_view import ScrollView
from textual.strip import Strip

from touchline.tui import format, theme
from touchline.tui.event_log import INFO, Entry, OperatorLog

ROOMY = 64
"""Width from which the source is shown."""
SOURCE_WIDTH = 10
MIN_TEXT_WIDTH = 8


class Block(NamedTuple):
    """Entry with its wrapped text."""

    entry: Entry
    rows: list[str]


def block(entry: Entry, width: int) -> Block:
    """Lay out an entry; long text is wrapped beside its time."""
    room = max(width - _margin(width), MIN_TEXT_WIDTH)
    rows = wrap(entry.text, room) or [""]
    if entry.times > 1:
        times = f"×{entry.times}"
        if len(rows[-1]) + 2 + len(times) <= room:
            rows[-1] += f"  {times}"
        else:
            rows.append(times)
    return Block(entry, rows)


def _margin(width: int) -> int:
    return 10 + (SOURCE_WIDTH + 1 if width >= ROOMY else 0)


def strip(shown: Block, row: int, width: int, ground: Style) -> Strip:
    """Render one row of an entry."""
    entry = shown.entry
    badge = theme.SEVERITIES[min(max(entry.severity, 0), len(theme.SEVERITIES) - 1)]
    muted = ground + Style(color=theme.MUTED)
    ink = ground + (Style(color=theme.INK) if entry.severity == INFO else Style(color=badge.color, bold=True))
    if row > 0:
        return Strip([Segment(" " * _margin(width), ground), Segment(shown.rows[row], ink)])
    time = format.duration(entry.time_s) if entry.time_s is not None else "–:––"
    segments = [Segment(f"{time:>7} ", muted), Segment(f"{badge.mark} ", ground + Style(color=badge.color))]
    if width >= ROOMY:
        segments.append(Segment(f"{entry.source[:SOURCE_WIDTH]:<{SOURCE_WIDTH}} ", muted))
    return Strip([*segments, Segment(shown.rows[row], ink)])


class LogView(ScrollView, can_focus=True):
    """List of the last events, the newest at the bottom."""

    def __init__(self) -> None:
        """Create an empty view."""
        super().__init__()
        self.border_title = "Events"
        self._events = OperatorLog()
        self._revision = self._total = self._cuts = self._width = 0
        self._blocks: list[Block] = []
        self._firsts: list[int] = []
        """First row of each block, counted since the first one ever."""
        self._end = 0

    @property
    def lines(self) -> list[str]:
        """List all rows of text."""
        return [row for shown in self._blocks for row in shown.rows]

    def show(self, log: OperatorLog) -> None:
        """Add new entries; a repeat of the last entry only counts there."""
        self._events = log
        if log.revision == self._revision or not self._width:
            return
        fresh = log.total - self._total
        if fresh >= len(log.entries) or log.cuts != self._cuts:
            self._cuts = log.cuts
            self._rebuild()
        else:
            self._forget_last()  # it may have been repeated
            for back in range(fresh + 1, 0, -1):
                self._append(log.entries[-back])
        self._settle()

    def _rebuild(self) -> None:
        self._blocks, self._firsts, self._end = [], [], 0
        for entry in self._events.entries:
            self._append(entry)

    def _append(self, entry: Entry) -> None:
        shown = block(entry, self._width)
        self._blocks.append(shown)
        self._firsts.append(self._end)
        self._end += len(shown.rows)

    def _forget_last(self) -> None:
        if self._blocks:
            self._blocks.pop()
            self._end = self._firsts.pop()

    def _settle(self) -> None:
        """Drop what the log has dropped, and keep the end in view if it was."""
        gone = len(self._blocks) - len(self._events.entries)
        del self._blocks[:gone], self._firsts[:gone]
        self._revision, self._total = self._events.revision, self._events.total
        at_end = self.scroll_offset.y >= self.max_scroll_y
        self.virtual_size = Size(self._width, self._end - self._firsts[0] if self._firsts else 0)
        if at_end:
            self.scroll_end(animate=False, x_axis=False)
        self.refresh()

    def render_line(self, y: int) -> Strip:
        """Render one line of the log."""
        width, ground = self.scrollable_content_region.width, self.rich_style
        row = y + self.scroll_offset.y + (self._firsts[0] if self._firsts else 0)
        if row >= self._end:
            return Strip.blank(width, ground)
        index = bisect_right(self._firsts, row) - 1
        return strip(self._blocks[index], row - self._firsts[index], self._width, ground).adjust_cell_length(
            width, ground
        )

    def on_resize(self, event: events.Resize) -> None:
        """Rewrap the lines."""
        width = self.scrollable_content_region.width
        if width != self._width:
            self._width = width
            self._rebuild()
        self._settle()
