"""Command palette: all commands of the console, by name."""

from collections.abc import Iterator
from functools import partial

from textual.app import App, SystemCommand

from touchline.tui import format, orders
from touchline.tui.keys import TABLE
from touchline.tui.operator import Operator


def commands(app: App[None], hand: Operator) -> Iterator[SystemCommand]:
    """Create the entries of the keys and of each speed."""
    for key in TABLE:
        if key.about:
            # Orders run after the palette has closed, as they may open a dialog; the stop runs at once.
            act = app.run_action if key.action == "estop" else partial(app.call_later, app.run_action)
            yield SystemCommand(key.name, f"{key.about} ({key.shown})", partial(act, key.action))
    for factor in orders.SPEEDS:
        name = "as fast as it goes" if factor < 0 else f"{format.factor(factor)} real time"
        yield SystemCommand(f"Speed {format.factor(factor)}", f"Simulate {name}", partial(hand.set_speed, factor))
