"""The command palette: everything the console can do, by name."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING

from textual.app import SystemCommand

from tui import format, orders

if TYPE_CHECKING:
    from tui.app import ConsoleApp


def commands(app: ConsoleApp) -> Iterator[SystemCommand]:
    """The entries, the most urgent first."""
    hand = app.operator
    yield SystemCommand("Emergency stop", "Stop the robot at once (e)", app.action_estop)
    yield SystemCommand("Choose template", "A shipped template or a file (t)", app.action_template)
    yield SystemCommand("Plan", "Plan the path for the template (p)", app.action_plan)
    yield SystemCommand("Load", "Load the plan into the robot (l)", hand.load)
    yield SystemCommand("Start", "Start painting (s)", partial(hand.command, "start"))
    yield SystemCommand("Pause", "Stop where it is; resume goes on (space)", partial(hand.command, "pause"))
    yield SystemCommand("Resume", "Go on after a pause (space)", partial(hand.command, "resume"))
    yield SystemCommand("Abort", "Give up the job (a)", app.action_abort)
    yield SystemCommand("Reset", "Make ready again after a stop or an abort (r)", partial(hand.command, "reset"))
    for factor in orders.SPEEDS:
        name = "as fast as it goes" if factor < 0 else f"{format.factor(factor)} real time"
        yield SystemCommand(f"Speed {format.factor(factor)}", f"Simulate {name}", partial(hand.set_speed, factor))
    yield SystemCommand("Follow the robot", "Keep it in the middle of the map (f)", app.action_follow)
    yield SystemCommand("Show the whole job", "Fit the map (0)", app.action_fit)
    yield SystemCommand("Keys", "List all keys (?)", app.action_keys)
    yield SystemCommand("Quit", "Leave the console (q)", app.action_quit)
