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
from touchline.tui.map_raster import MISSED_MARK, Ink
from touchline.tui.mono_cells import MARKS

KEYS_TEXT = (
    ("Job", (
        ("t, p, l, s", "choose a template, plan it, load it, start"), ("d", "drive to a goal"),
        ("space, g", "pause, go on"), ("a", "abort (asks first)"),
        ("r", "reset after a stop or an abort"),
        ("u, b", "tank filled up, battery replaced"),
    )),
    ("Goal", (
        ("arrows, drag", "move it (Shift: finely); drag its heading"), ("< >, h", "turn it, any heading"),
        ("m, enter, esc", "how to drive; preview, then drive; leave"),
    )),
    ("Stop", (("e, ctrl+e", "stop every robot, at once; ctrl+e anywhere"),)),
    ("Time", (("[ , and ] .", "slower and faster"),)),
    ("Replay", (("< > { } n", "10 s, a minute; a step; space pauses, goes on"),)),
    ("Map", (
        ("arrows, drag", "pan"), ("+ -, wheel", "zoom"), ("f, 0, home", "follow the robot, show the whole job"),
    )),
    ("Fleet", (("v, o, x", "all robots; the next one; orders to all"),)),
    ("Console", (("tab", "next panel"), ("ctrl+p, q", "all commands by name, quit"))),
)  # fmt: skip
FLEET_KEYS_TEXT = (
    ("Robot", (
        ("arrows, click", "pick one; enter or a second click: alone"),
        ("space, g", "pause it, let it go on"), ("a, r", "abort (asks first), reset"), ("o", "pick the next by name"),
    )),
    ("All", (("x", "pause, resume, abort, reset (asks first)"),)),
    ("Stop", (("e, ctrl+e", "stop every robot, at once; ctrl+e anywhere"),)),
    ("List", (("n", "sort by name, or those in trouble first"), ("m", "map and list, list, map"))),
    ("Map", (("+ -, wheel, drag", "zoom, pan"), ("f, 0", "follow the robot, show all"))),
    ("Console", (("esc, v", "put answers away, then back to one robot"), ("ctrl+p, q", "all commands, quit"))),
)  # fmt: skip
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
    ("→", f"{theme.BLACK} on {theme.ORANGE}", "robot"),
    ("→", f"{theme.BLACK} on {theme.SKY}", "goal"),
)
SHAPES_LEGEND = (
    ("⠶", "bold", "painted"),
    ("⢕", "", "to paint"),
    ("⠶", "reverse", "now"),
    (MARKS[Ink.PATH], "", "driven only"),
    (MISSED_MARK, "bold", "missed"),
    ("→", "reverse", "robot, goal"),
)
"""Legend without colours; see `mono_cells`."""


class KeysDialog(Dialog[None]):
    """Scrolling list of all keys."""

    NOTE = (("esc", "close"), ("↑ ↓", "more"))
    BINDINGS: ClassVar[list[BindingType]] = [Binding("question_mark,q", "dismiss(None)", "Close")]

    def __init__(self, *, fleet: bool = False) -> None:
        """Create the list for the screen of one robot, or of the `fleet`."""
        super().__init__()
        self._text = FLEET_KEYS_TEXT if fleet else KEYS_TEXT
        self._legend = FLEET_LEGEND if fleet else LEGEND

    def compose(self) -> ComposeResult:
        """Lay out the legend of the map and the list."""
        legend = self._legend if has_colors(self.app) or self._legend is not LEGEND else SHAPES_LEGEND
        with DialogBox(id="dialog", can_focus=True):
            yield Label("Keys", classes="title")
            marks = [((f"{mark} ", style), (f"{text}   ", "")) for mark, style, text in legend]
            lines = [Content.assemble(*(part for pair in marks for part in pair))]
            width = 1 + max(len(key) for _, keys in self._text for key, _ in keys)
            for group, keys in self._text:
                for index, (key, text) in enumerate(keys):
                    name = group if index == 0 else ""
                    lines.append(
                        Content.assemble((f"{name:<9}", theme.MUTED), (f"{key:<{width}}", f"bold {theme.SKY}"), text)
                    )
            yield Static(Content("\n").join(lines))

    def on_mount(self) -> None:
        """Focus the list for scrolling."""
        self.query_one("#dialog").focus()
