"""Order line and emergency-stop button on every dialog and on the palette."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, cast

from textual import events
from textual.command import CommandList, CommandPalette
from textual.containers import Horizontal
from textual.content import Content
from textual.screen import Screen
from textual.widgets import Static

from touchline.tui import theme
from touchline.tui.robots import Robots
from touchline.tui.signal_bar import SignalBar


class Console(Protocol):
    """Part of the console that these screens need."""

    robots: Robots


class NoteBar(Static):
    """Keys of a dialog beside the emergency stop; keys that do not fit are left out."""

    def __init__(self, keys: Sequence[tuple[str, str]]) -> None:
        """Create the bar for keys and their effects, the most important first."""
        super().__init__()
        self._keys = keys

    def on_resize(self) -> None:
        """Show the keys that fit."""
        room, parts = self.size.width, list[Content]()
        for key, text in self._keys:
            part = Content.assemble((f"  {key} ", f"bold {theme.SKY}"), (text, theme.INK))
            room -= part.cell_length
            if room < 0:
                break
            parts.append(part)
        self.update(Content("").join(parts))


class StopKey(Static):
    """Button of the emergency stop, at its place in the key bar."""

    def __init__(self) -> None:
        """Create the button, with the key that works everywhere."""
        super().__init__(Content.styled(" ctrl+e E-STOP ", theme.STOP_LABEL))

    async def on_click(self, event: events.Click) -> None:
        """Stop the robots."""
        event.stop()
        await self.app.run_action("estop", self.app)


def add_stop(screen: Screen[Any], keys: Sequence[tuple[str, str]] = ()) -> None:
    """Add the order line, the emergency stop and keys beside it to a screen, where the console has them."""
    signals, stop, note = SignalBar(), StopKey(), NoteBar(keys)
    row = Horizontal(stop, note)
    # Not in the style sheet, because that of the console does not hold for the palette.
    signals.styles.dock, signals.styles.height, signals.styles.margin = "top", 1, (1, 0, 0, 0)
    row.styles.dock, row.styles.height, row.styles.background = "bottom", 1, theme.PANEL
    stop.styles.width, stop.styles.height, note.styles.width, note.styles.height = "auto", 1, "1fr", 1
    note.styles.text_wrap = "nowrap"
    screen.mount(signals, row)
    signals.show(cast(Console, screen.app).robots)


class Palette(CommandPalette):
    """Command palette with the emergency stop."""

    def on_mount(self) -> None:
        """Add the stop; the list of commands, which lies on top of everything, leaves its row free."""
        add_stop(self, (("enter", "choose"), ("esc", "close"), ("type", "to find")))
        self.query_one(CommandList).styles.max_height = "55vh"
