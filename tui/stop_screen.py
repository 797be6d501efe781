"""Order line and emergency-stop button on every dialog and on the palette."""

from __future__ import annotations

from typing import Any, Protocol, cast

from textual import events
from textual.command import CommandList, CommandPalette
from textual.content import Content
from textual.screen import Screen
from textual.widgets import Static

from touchline.tui import theme
from touchline.tui.robots import Robots
from touchline.tui.signal_bar import SignalBar


class Console(Protocol):
    """The part of the console that such a screen needs."""

    robots: Robots


class StopKey(Static):
    """The emergency stop, where the key bar has it."""

    def __init__(self) -> None:
        """With the key that works everywhere."""
        super().__init__(Content.styled(" ctrl+e E-STOP ", f"bold {theme.WHITE} on {theme.VERMILION}"))

    async def on_click(self, event: events.Click) -> None:
        """Stop the robots."""
        event.stop()
        await self.app.run_action("estop", self.app)


def add_stop(screen: Screen[Any]) -> None:
    """Add the order line and the emergency stop to a screen, at the places where the console has them."""
    signals, key = SignalBar(), StopKey()
    # Not in the style sheet, because that of the console does not hold for the palette.
    signals.styles.dock, signals.styles.height, signals.styles.margin = "top", 1, (1, 0, 0, 0)
    key.styles.dock, key.styles.height, key.styles.width = "bottom", 1, "auto"
    screen.mount(signals, key)
    signals.show(cast(Console, screen.app).robots)


class Palette(CommandPalette):
    """The command palette, with the emergency stop."""

    def on_mount(self) -> None:
        """Add it; the list of commands, which lies on top of everything, leaves its row free."""
        add_stop(self)
        self.query_one(CommandList).styles.max_height = "55vh"
