"""Dialog with all keys and the map's colours."""

from __future__ import annotations

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.widgets import Label, Static

from touchline.tui import theme
from touchline.tui.colors import has_colors
from touchline.tui.dialogs import Dialog, DialogBox
from touchline.tui.keys import FLEET_TABLE, TABLE, listed
from touchline.tui.map_raster import MISSED_MARK, Ink
from touchline.tui.mono_cells import MARKS
from touchline.tui.obstacle_view import ABSENT_MARK, KIND_MARKS, THING_MARK

FLEET_LEGEND = (
    ("→", f"{theme.BLACK} on {theme.ORANGE}", "picked"),
    ("→", f"{theme.BLACK} on {theme.MUTED}", "other"),
    ("→", f"{theme.WHITE} on {theme.STOP}", "stopped"),
    ("?", f"{theme.BLACK} on {theme.YELLOW}", "silent"),
    ("✗", f"{theme.WHITE} on {theme.STOP}", "gone"),
    ("3", f"{theme.BLACK} on {theme.MUTED}", "so many"),
)
LEGEND = (
    ("●", theme.WHITE, "painted"),
    ("●", theme.TO_PAINT, "to paint"),
    ("●", theme.YELLOW, "now"),
    ("●", theme.PATH, "driven only"),
    (MISSED_MARK, theme.VERMILION, "missed"),
    ("●", theme.PURPLE, "limit"),
    ("●", theme.ORANGE, "zone"),
)
MARKS_LEGEND = (
    ("→", f"{theme.BLACK} on {theme.ORANGE}", "robot"),
    ("→", f"{theme.BLACK} on {theme.SKY}", "goal"),
    *((mark, f"{theme.BLACK} on {theme.VERMILION}", kind) for kind, mark in KIND_MARKS.items()),
    (THING_MARK, f"{theme.BLACK} on {theme.VERMILION}", "thing"),
    (ABSENT_MARK, f"{theme.BLACK} on {theme.PURPLE}", "missing"),
)
"""Legend of marks in whole cells, with and without colours."""
SHAPES_LEGEND = (
    ("⠶", "bold", "painted"),
    ("⢕", "", "to paint"),
    ("⠶", "reverse", "now"),
    (MARKS[Ink.PATH], "", "driven only"),
    (MISSED_MARK, "bold", "missed"),
    (MARKS[Ink.LIMIT], "", "limit"),
    (MARKS[Ink.STOP_ZONE], "", "stops"),
    (MARKS[Ink.SLOW_ZONE], "", "slows"),
    (MARKS[Ink.SEEN], "", "seen"),
)
"""Legend without colours; see `mono_cells`."""


class KeysDialog(Dialog[None]):
    """Scrolling list of all keys."""

    NOTE = (("esc", "close"), ("↑ ↓", "more"))
    BINDINGS: ClassVar[list[BindingType]] = [Binding("question_mark,q", "dismiss(None)", "Close")]

    def __init__(self, *, fleet: bool = False) -> None:
        """Create the list for the screen of one robot, or of the `fleet`."""
        super().__init__()
        self._keys = listed(FLEET_TABLE if fleet else TABLE)
        self._legend = FLEET_LEGEND if fleet else LEGEND
        self._marks = () if fleet else MARKS_LEGEND

    def compose(self) -> ComposeResult:
        """Lay out the legend of the map and the list."""
        legend = self._legend if has_colors(self.app) or self._legend is not LEGEND else SHAPES_LEGEND
        with DialogBox(id="dialog", can_focus=True):
            yield Label("Keys", classes="title")
            lines = [_legend_line(marks) for marks in (legend, self._marks) if marks]
            width = 1 + max(len(key) for _, key, _ in self._keys)
            before = ""
            for group, key, effect in self._keys:
                name = "" if group == before else group
                before = group
                lines.append(
                    Content.assemble((f"{name:<9}", theme.MUTED), (f"{key:<{width}}", f"bold {theme.SKY}"), effect)
                )
            yield Static(Content("\n").join(lines))

    def on_mount(self) -> None:
        """Focus the list for scrolling."""
        self.query_one("#dialog").focus()


def _legend_line(marks: tuple[tuple[str, str, str], ...]) -> Content:
    pairs = [((f"{mark} ", style), (f"{text}   ", "")) for mark, style, text in marks]
    return Content.assemble(*(part for pair in pairs for part in pair))
