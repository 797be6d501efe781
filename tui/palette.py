"""The command palette: everything the console can do, by name."""

from collections.abc import Iterator
from functools import partial

from textual.app import App, SystemCommand

from touchline.tui import format, orders
from touchline.tui.operator import Operator


def commands(app: App[None], hand: Operator) -> Iterator[SystemCommand]:
    """The entries, the most urgent first; what needs the screen is an action of the ``app``."""
    yield SystemCommand("Emergency stop", "Stop all robots at once (e)", partial(app.run_action, "estop"))
    yield SystemCommand("Choose template", "A shipped template or a file (t)", partial(app.run_action, "template"))
    yield SystemCommand("Plan", "Plan the path for the template (p)", partial(app.run_action, "plan"))
    yield SystemCommand("Load", "Load the plan into the robot (l)", partial(app.call_later, app.run_action, "load"))
    yield SystemCommand("Go on with the job", "Do what an abort or a restart of the robot left (g)", hand.go_on)
    yield SystemCommand("Start", "Start painting (s)", partial(app.call_later, app.run_action, "command('start')"))
    yield SystemCommand("Drive to a goal", "Aim on the map, preview, drive (d)", partial(app.run_action, "drive"))
    yield SystemCommand("Pause", "Stop where it is; resume goes on (space)", partial(hand.command, "pause"))
    yield SystemCommand("Resume", "Go on after a pause (g)", partial(hand.command, "resume"))
    yield SystemCommand("Abort", "Give up the job (a)", partial(app.run_action, "abort"))
    yield SystemCommand("Reset", "Make ready again after a stop or an abort (r)", partial(hand.command, "reset"))
    yield SystemCommand("Refill tank", "The tank has been filled up (u)", partial(hand.command, "refill"))
    yield SystemCommand("Replace battery", "A full battery has been put in (b)", partial(hand.command, "battery"))
    for factor in orders.SPEEDS:
        name = "as fast as it goes" if factor < 0 else f"{format.factor(factor)} real time"
        yield SystemCommand(f"Speed {format.factor(factor)}", f"Simulate {name}", partial(hand.set_speed, factor))
    yield SystemCommand("Fleet", "All robots on one screen (v)", partial(app.run_action, "fleet"))
    text = "Pause, resume, abort or reset all robots (x)"
    yield SystemCommand("Order to all", text, partial(app.call_later, app.run_action, "order_all"))
    yield SystemCommand("Other robot", "Bring the next robot into view (o)", partial(app.run_action, "next_robot"))
    yield SystemCommand("Follow the robot", "Keep it in the middle of the map (f)", partial(app.run_action, "follow"))
    yield SystemCommand("Show the whole job", "Fit the map (0)", partial(app.run_action, "fit"))
    yield SystemCommand("Keys", "List all keys (?)", partial(app.run_action, "keys"))
    yield SystemCommand("Quit", "Leave the console (q)", partial(app.run_action, "quit"))
