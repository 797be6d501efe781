"""Table of painted segments with a bar each, the current one in view, below missed patches."""

from __future__ import annotations

from rich.segment import Segment
from rich.style import Style
from textual import events
from textual.geometry import Region, Size
from textual.scroll_view import ScrollView
from textual.strip import Strip

from touchline.schemas.messages.coverage_messages import MissedPatch
from touchline.tui import format, theme
from touchline.tui.map_raster import MISSED_MARK
from touchline.tui.state import ConsoleState, missed_patches

BAR_WIDTH = 6
SLACK_M = 0.03
"""Missing length up to which a line is done: about the precision of the valve."""
BEGUN = 0.02
"""Painted share below which the paint is that of a crossing line."""

Line = tuple[str, float, float, bool]
"""(label, length m, painted share, whether it is the current one)"""


def is_done(line: Line) -> bool:
    """True if the whole line is painted."""
    _, length_m, share, _ = line
    return share >= 1.0 or (1.0 - share) * length_m <= SLACK_M


class SegmentsTable(ScrollView, can_focus=True):
    """Table with one line per segment to paint, in path order."""

    def __init__(self) -> None:
        """Create an empty table."""
        super().__init__()
        self.border_title = "Lines"
        self._lines: list[Line] = []
        self._missed: tuple[MissedPatch, ...] = ()
        self._active: int | None = None

    def show(self, state: ConsoleState) -> None:
        """Redraw the lines that changed, and scroll to the current one when it changes."""
        fractions, goal = state.robot.fractions, state.goal
        lines = [
            (row.label, row.length_m, fractions.get(row.segment_id, 0.0), row.segment_id == goal) for row in state.rows
        ]
        missed = missed_patches(state)
        if lines == self._lines and missed == self._missed:
            return
        before, self._lines, title = self._lines, lines, state.worked_along.capitalize()
        was, self._missed = self._missed, missed
        done = sum(map(is_done, lines))
        title = f"{title} {done}/{len(lines)}" if lines else title
        self.border_title = f"Missed {len(missed)} · {title}" if missed else title
        if len(before) != len(lines) or was != missed:
            self.virtual_size = Size(self.content_size.width, len(missed) + len(lines))
            self.refresh()
        else:
            for index, (old, new) in enumerate(zip(before, lines, strict=True)):
                if old != new:
                    self.refresh_line(index + len(missed))
        active = next((index + len(missed) for index, line in enumerate(lines) if line[3]), None)
        if active is not None and active != self._active:
            self._reveal(active)
        self._active = active

    def _reveal(self, index: int) -> None:
        """Scroll a line to the middle, once the layout has all lines."""
        self.call_after_refresh(self.scroll_to, y=max(index - self.content_size.height // 2, 0), animate=False)

    def on_resize(self, event: events.Resize) -> None:
        """Keep the current line in view."""
        self.virtual_size = Size(self.content_size.width, len(self._missed) + len(self._lines))
        if self._active is not None:
            self._reveal(self._active)

    def refresh_line(self, y: int) -> None:
        """Redraw one line of the table."""
        self.refresh(Region(0, y - self.scroll_offset.y, self.content_size.width, 1))

    def render_line(self, y: int) -> Strip:
        """Render one line of the table."""
        width, index = self.scrollable_content_region.width, y + self.scroll_offset.y - len(self._missed)
        ground = self.rich_style
        if index < 0:
            return self._missed_line(self._missed[index], width)
        if index >= len(self._lines):
            return Strip.blank(width, ground)
        label, length_m, share, active = line = self._lines[index]
        if active:
            mark, color = "►", theme.YELLOW
        elif is_done(line):
            mark, color = "✓", theme.WHITE
        else:
            mark, color = ("◔", theme.INK) if share > BEGUN else ("·", theme.MUTED)
        filled, rest = format.bar(1.0 if is_done(line) else share, BAR_WIDTH)
        room = max(width - BAR_WIDTH - 11, 4)
        name = format.cut(label, room)
        segments = [
            Segment(f"{mark} {name:<{room}}", ground + Style(color=color, bold=active)),
            Segment(f"{format.length(length_m):>7} ", ground + Style(color=theme.MUTED)),
            Segment(filled, ground + Style(color=theme.YELLOW if active else theme.WHITE)),
            Segment(rest, ground + Style(color=theme.TURF_GRID)),
        ]
        return Strip(segments).adjust_cell_length(width, ground)

    def _missed_line(self, patch: MissedPatch, width: int) -> Strip:
        """Render size and position of a missed patch."""
        digits = 1 if patch.area_m2 >= 1.0 else 2
        size, place = format.number(patch.area_m2, digits, "m²"), f"at {patch.x_m + 0.0:.1f}, {patch.y_m + 0.0:.1f} m"
        segments = [
            Segment(f"{MISSED_MARK} {size:>9}  ", self.rich_style + Style(color=theme.VERMILION, bold=True)),
            Segment(place, self.rich_style + Style(color=theme.INK)),
        ]
        return Strip(segments).adjust_cell_length(width, self.rich_style)
