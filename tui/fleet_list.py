"""Widget with the list of all robots, of which only the rows in view are drawn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from rich.segment import Segment
from rich.style import Style
from textual import events
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.geometry import Region, Size
from textual.message import Message
from textual.scroll_view import ScrollView
from textual.strip import Strip

from touchline.tui import format, theme
from touchline.tui.alerts import LOW_BATTERY
from touchline.tui.fleet_rows import FleetRow, FleetTotals

NAME_WIDTH = 12
CRAMPED = 32
"""Width below which there is room for a short name and the state only."""
ALERT_WIDTH = 12
"""Minimum width of an alert, to which columns of figures yield."""


@dataclass(frozen=True)
class Column:
    """Column: head, width, text, and colour if it is not the row's."""

    head: str
    width: int
    text: Callable[[FleetRow], str]
    color: Callable[[FleetRow], str | None] = lambda row: None
    right: bool = False


def _battery_color(row: FleetRow) -> str | None:
    return theme.VERMILION if row.battery is not None and row.battery < LOW_BATTERY else None


def _name(row: FleetRow) -> str:
    """Name, with a mark if the robot is in another frame than the map."""
    return format.cut(row.name, NAME_WIDTH - 2) + (" ≠" if row.elsewhere else "")


NAME = Column("robot", NAME_WIDTH, _name)
STATE = Column("state", 11, lambda row: f"{row.badge.mark} {row.badge.text}", lambda row: row.badge.color)
FIGURES = (
    Column("batt", 5, lambda row: format.percent(row.battery), _battery_color, right=True),
    Column("done", 5, lambda row: format.percent(row.progress), right=True),
    Column("m/s", 5, lambda row: format.number(row.speed_mps, 2), right=True),
    Column("pose ±", 6, lambda row: format.length(row.off_m), right=True),
)
"""Columns, those further left kept longer where room is short."""


def columns(width: int) -> tuple[Column, ...]:
    """Columns that fit; the alert takes the remaining width."""
    if width < CRAMPED:
        return (replace(NAME, width=6), replace(STATE, width=width - 9))
    room = width - NAME.width - STATE.width - 3 - ALERT_WIDTH
    shown = []
    for column in FIGURES:
        room -= column.width + 1
        if room >= 0:
            shown.append(column)
    return (NAME, STATE, *shown)


def head_line(width: int) -> Strip:
    """Render the head of the columns."""
    style = Style.parse(f"{theme.MUTED} on {theme.PANEL}")
    texts = [_fit(column.head, column) for column in columns(width)]
    return Strip([Segment(f" {' '.join(texts)} alert", style)]).adjust_cell_length(width, style)


def row_line(row: FleetRow, width: int, *, selected: bool) -> Strip:
    """Render the row of a robot, `width` cells wide."""
    ground = f"on {theme.BLACK}"
    segments = [Segment("▌" if selected else " ", Style.parse(f"{theme.SKY} {ground}"))]
    ink = theme.MUTED if row.doubtful else theme.INK
    for column in columns(width):
        color = None if row.doubtful and column.head != STATE.head else column.color(row)
        style = f"bold {color or ink} {ground}" if color or column.head == NAME.head else f"{ink} {ground}"
        if column.head == NAME.head and selected:
            style = f"bold {theme.BLACK} on {theme.SKY}"
        elif column.head == STATE.head and row.badge.on != theme.BLACK:
            style = f"bold {row.badge.on} on {row.badge.color}"
        segments += [Segment(_fit(column.text(row), column), Style.parse(style)), Segment(" ", Style.parse(ground))]
    mark, color = ("▲ ", f"bold {theme.ORANGE}") if row.grave else ("", theme.MUTED)
    segments.append(Segment(f"{mark if row.alert else ''}{row.alert}", Style.parse(f"{color} {ground}")))
    return Strip(segments).adjust_cell_length(width, Style.parse(ground))


def _fit(text: str, column: Column) -> str:
    text = text if len(text) <= column.width else text[: column.width - 1] + "…"
    return text.rjust(column.width) if column.right else text.ljust(column.width)


def totals_line(found: FleetTotals, width: int, note: str) -> Content:
    """Render the number of robots by state, the worst first, and the minimum charge, as far as there is room."""
    loud, bad = f"bold {theme.ORANGE}", f"bold {theme.VERMILION}"
    counts = (
        (found.silent, "▲ {} silent", loud),
        (found.gone, "✗ {} gone", bad),
        (found.stopped, "■ {} stopped", bad),
        (found.paused, "‖ {} paused", theme.ORANGE),
        (found.running, "► {} running", theme.GREEN),
    )
    parts = [(f"  {text.format(count)}", color if count else theme.FAINT) for count, text, color in counts]
    if not found.gone:
        parts.pop(1)
    if found.least_battery is not None:
        charge, name = found.least_battery
        color = loud if charge < LOW_BATTERY else theme.INK
        parts += [(f"  batt ≥ {format.percent(charge)}", color), (f" {format.cut(name, NAME_WIDTH)}", color)]
    parts.append((f"  {note}", theme.MUTED))
    line = Content.assemble((" FLEET ", f"bold {theme.BLACK} on {theme.GREEN}"), (f" {found.robots}", "bold"))
    for text, style in parts:
        if line.cell_length + len(text) > width:
            break
        line += Content.styled(text, style)
    return line


class RobotPicked(Message):
    """Message: the operator has picked a robot; `shown` if it is to be shown alone."""

    def __init__(self, name: str, *, shown: bool = False) -> None:
        """Create the message for a robot by name."""
        super().__init__()
        self.name, self.shown = name, shown


class FleetList(ScrollView, can_focus=True):
    """List of robots, a row each; arrow keys and clicks pick one, Enter or a click on the picked one shows it."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up", "pick(-1)", "Up", show=False),
        Binding("down", "pick(1)", "Down", show=False),
        Binding("pageup", "page(-1)", "Page up", show=False),
        Binding("pagedown", "page(1)", "Page down", show=False),
        Binding("home", "pick(-100000)", "First", show=False),
        Binding("end", "pick(100000)", "Last", show=False),
        Binding("enter", "take", "Show", show=False),
    ]

    def __init__(self) -> None:
        """Create an empty list."""
        super().__init__()
        self._rows: Sequence[FleetRow] = ()
        self._selected = ""

    def show(self, rows: Sequence[FleetRow], selected: str) -> None:
        """Redraw the rows that changed; a robot that is picked comes into view."""
        before = self._rows
        self._rows, moved = rows, selected != self._selected
        changed = {row.name for row in before[: len(rows)]} ^ {row.name for row in rows[: len(before)]}
        stale = [
            number
            for number, row in enumerate(rows)
            if number >= len(before) or row != before[number] or (moved and row.name in (selected, self._selected))
        ]
        self._selected = selected
        if self.virtual_size.height != len(rows) + self._head:
            self.virtual_size = Size(0, len(rows) + self._head)
        if len(rows) != len(before) or changed:
            self.refresh()
        top = self.scroll_offset.y
        for number in stale:
            y = number - top + self._head
            if self._head <= y < self.size.height:
                self.refresh(Region(0, y, self.size.width, 1))
        if moved and before:  # as it is opened, those in trouble are at the top
            self._keep_in_view()

    def _index(self) -> int:
        return next((number for number, row in enumerate(self._rows) if row.name == self._selected), 0)

    def _keep_in_view(self) -> None:
        index, top, height = self._index(), self.scroll_offset.y, self._page
        if not top <= index < top + height:
            self.scroll_to(y=index - (0 if index < top else height - 1), animate=False, force=True, immediate=True)

    @property
    def _head(self) -> int:
        """Number of rows of the head: 0 where there is hardly room for robots."""
        return int(self.size.height > 2)

    @property
    def _page(self) -> int:
        """Number of rows in view, below the head."""
        return max(self.size.height - self._head, 1)

    def render_line(self, y: int) -> Strip:
        """Render the head, or the row of a robot."""
        width, number = self.size.width, y - self._head + self.scroll_offset.y
        if y < self._head:
            return head_line(width)
        if number >= len(self._rows):
            return Strip.blank(width, Style.parse(f"on {theme.BLACK}"))
        row = self._rows[number]
        return row_line(row, width, selected=row.name == self._selected)

    def watch_scroll_y(self, old_value: float, new_value: float) -> None:
        """Refresh all rows after scrolling."""
        super().watch_scroll_y(old_value, new_value)
        self.refresh()

    def action_pick(self, steps: int) -> None:
        """Pick the robot a number of rows further down."""
        if self._rows:
            index = min(max(self._index() + steps, 0), len(self._rows) - 1)
            self.post_message(RobotPicked(self._rows[index].name))

    def action_page(self, pages: int) -> None:
        """Pick the robot a page further down."""
        self.action_pick(pages * self._page)

    def action_take(self) -> None:
        """Show the picked robot alone."""
        self.post_message(RobotPicked(self._selected, shown=True))

    def on_click(self, event: events.Click) -> None:
        """Pick the robot of the row; the picked one is shown alone."""
        number = event.y - self._head + self.scroll_offset.y
        if event.y >= self._head and number < len(self._rows):
            name = self._rows[number].name
            self.post_message(RobotPicked(name, shown=name == self._selected))
