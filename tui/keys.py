"""Table of the console's keys, from which bindings, key bars and command palette are made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import cache

from textual.binding import Binding


class Bar(Enum):
    """Key bars at the bottom, by the state of the console."""

    JOB = "job"
    AIM = "aim"
    """Bar while the operator aims at a goal; keys that are not shown still work."""
    REPLAY = "replay"
    """Bar of a replay; keys that are not shown are refused."""
    FLEET = "fleet"


@dataclass(frozen=True)
class BarKey:
    """Key of a bar: key, effect, action, and rank when room is short (0 is first)."""

    key: str
    text: str
    action: str
    rank: int


@dataclass(frozen=True)
class ConsoleKey:
    """Key of the console, or a command without a key.

    Attributes:
        shown: Key as bars and help show it.
        action: Textual's name of the action, with its namespace for the fleet's screen.
        name: Name in the list of bindings and the command palette.
        keys: Textual's names of the keys, separated by commas; "" for a key that is bound elsewhere.
        about: Effect, for the command palette; "" for no entry there.
        bars: Text and rank in each bar with the key.
        urgent: Whether it works in dialogs, too.
    """

    shown: str
    action: str
    name: str = ""
    keys: str = ""
    about: str = ""
    bars: Mapping[Bar, tuple[str, int]] = field(default_factory=dict)
    urgent: bool = False


TABLE = (
    ConsoleKey("ctrl+e", "estop", "Emergency stop", "ctrl+e", urgent=True),
    ConsoleKey(
        *("e", "estop", "Emergency stop", "e", "Stop all robots at once"),
        {Bar.JOB: ("E-STOP", 0), Bar.AIM: ("E-STOP", 0), Bar.REPLAY: ("E-STOP", 0)},
    ),
    ConsoleKey("enter", "aim('go')", "Preview the drive, then drive", "enter", bars={Bar.AIM: ("Go", 1)}),
    ConsoleKey("arrows", "keys", bars={Bar.AIM: ("Place", 2)}),
    ConsoleKey("< >", "turn(1)", "Turn the goal left", "less_than_sign", bars={Bar.AIM: ("Turn", 1)}),
    ConsoleKey(">", "turn(-1)", "Turn the goal right", "greater_than_sign"),
    ConsoleKey("h", "aim('free')", "Any heading", "h", bars={Bar.AIM: ("Any heading", 1)}),
    ConsoleKey("m", "aim('how')", "How to drive there", "m", bars={Bar.AIM: ("How", 1)}),
    ConsoleKey("esc", "aim('leave')", "Aim no longer", "escape", bars={Bar.AIM: ("Leave", 1)}),
    ConsoleKey(
        "t", "template", "Choose template", "t", "A shipped template or a file", {Bar.JOB: ("Template", 1)}
    ),
    ConsoleKey("p", "plan", "Plan", "p", "Plan the path for the template", {Bar.JOB: ("Plan", 1)}),
    ConsoleKey("l", "load", "Load", "l", "Load the plan into the robot", {Bar.JOB: ("Load", 1)}),
    ConsoleKey("s", "command('start')", "Start", "s", "Start painting", {Bar.JOB: ("Start", 1)}),
    ConsoleKey(
        *("space", "command('pause')", "Pause", "space", "Stop where it is; resume goes on"),
        {Bar.JOB: ("Pause", 1), Bar.REPLAY: ("Pause/go on", 1)},
    ),
    ConsoleKey(
        "g", "command('resume')", "Go on", "g", "Resume after a pause; or an unfinished job", {Bar.JOB: ("Go on", 1)}
    ),
    ConsoleKey("g", "go_on", "Go on with the job", about="Do what an abort or a restart of the robot left"),
    ConsoleKey("a", "abort", "Abort", "a", "Give up the job", {Bar.JOB: ("Abort", 1)}),
    ConsoleKey(
        *("r", "command('reset')", "Reset", "r", "Make ready again after a stop or an abort"), {Bar.JOB: ("Reset", 1)}
    ),
    ConsoleKey(
        *("u", "command('refill')", "Refill tank", "u", "The tank has been filled up"), {Bar.JOB: ("Refill", 1)}
    ),
    ConsoleKey(
        *("b", "command('battery')", "Replace battery", "b", "A full battery has been put in"),
        {Bar.JOB: ("Battery", 1)},
    ),
    ConsoleKey("d", "drive", "Drive to a goal", "d", "Aim on the map, preview, drive", {Bar.JOB: ("Drive to", 1)}),
    ConsoleKey("< >", "seek(10)", bars={Bar.REPLAY: ("10 s", 1)}),
    ConsoleKey("<", "seek(-10)", "Replay: 10 s back", "less_than_sign"),
    ConsoleKey(">", "seek(10)", "Replay: 10 s on", "greater_than_sign"),
    ConsoleKey("{", "seek(-60)", "Replay: a minute back", "left_curly_bracket"),
    ConsoleKey("{ }", "seek(60)", "Replay: a minute on", "right_curly_bracket", bars={Bar.REPLAY: ("1 min", 2)}),
    ConsoleKey("n", "step", "Replay: a step", "n", bars={Bar.REPLAY: ("Step", 1)}),
    ConsoleKey(
        "[ ]", "speed(1)", "Faster", "right_square_bracket,full_stop",
        bars={Bar.JOB: ("Speed", 1), Bar.REPLAY: ("Speed", 1)},
    ),
    ConsoleKey("[", "speed(-1)", "Slower", "left_square_bracket,comma"),
    ConsoleKey(
        *("v", "fleet", "Fleet", "v", "All robots on one screen"), {Bar.JOB: ("Fleet", 1), Bar.REPLAY: ("Fleet", 2)}
    ),
    ConsoleKey(
        *("o", "next_robot", "Other robot", "o", "Bring the next robot into view"),
        {Bar.JOB: ("Other robot", 1), Bar.REPLAY: ("Other robot", 2)},
    ),
    ConsoleKey(
        "x", "order_all", "Order to all", "x", "Pause, resume, abort or reset all robots", {Bar.JOB: ("All…", 3)}
    ),
    ConsoleKey(
        *("f", "follow", "Follow the robot", "f", "Keep it in the middle of the map"),
        {Bar.JOB: ("Follow", 3), Bar.REPLAY: ("Follow", 3)},
    ),
    ConsoleKey(
        *("0", "fit", "Show the whole job", "0,home", "Fit the map"), {Bar.JOB: ("Fit", 4), Bar.REPLAY: ("Fit", 4)}
    ),
    ConsoleKey(
        "+ -", "zoom(1)", "Zoom in", "plus,equals_sign",
        bars={Bar.JOB: ("Zoom", 5), Bar.AIM: ("Zoom", 3), Bar.REPLAY: ("Zoom", 5)},
    ),
    ConsoleKey("-", "zoom(-1)", "Zoom out", "minus,underscore"),
    ConsoleKey("space", "command('pause')", bars={Bar.AIM: ("Pause", 1)}),
    ConsoleKey(
        *("?", "keys", "Keys", "question_mark", "List all keys"),
        {Bar.JOB: ("Keys", 2), Bar.AIM: ("Keys", 3), Bar.REPLAY: ("Keys", 2)},
    ),
    ConsoleKey("^p", "command_palette", bars={Bar.JOB: ("Commands", 6)}),
    ConsoleKey("q", "quit", "Quit", "q", "Leave the console", {Bar.JOB: ("Quit", 7), Bar.REPLAY: ("Quit", 7)}),
)  # fmt: skip
FLEET_TABLE = (
    ConsoleKey("e", "app.estop", bars={Bar.FLEET: ("E-STOP", 0)}),
    ConsoleKey("enter", "screen.leave", bars={Bar.FLEET: ("Show", 1)}),
    ConsoleKey("x", "app.order_all", bars={Bar.FLEET: ("All…", 1)}),
    ConsoleKey("space", "app.command('pause')", bars={Bar.FLEET: ("Pause", 2)}),
    ConsoleKey("g", "app.command('resume')", bars={Bar.FLEET: ("Resume", 2)}),
    ConsoleKey("a", "app.abort", bars={Bar.FLEET: ("Abort", 3)}),
    ConsoleKey("r", "app.command('reset')", bars={Bar.FLEET: ("Reset", 3)}),
    ConsoleKey("esc", "screen.back", "Back", "escape"),
    ConsoleKey("v", "screen.leave", "Back", "v"),
    ConsoleKey("n", "screen.sort", "Sort", "n", bars={Bar.FLEET: ("Sort", 4)}),
    ConsoleKey("m", "screen.shown", "Map or list", "m", bars={Bar.FLEET: ("Map/list", 4)}),
    ConsoleKey("0", "screen.fit", "Show all robots", "0", bars={Bar.FLEET: ("Fit", 5)}),
    ConsoleKey("f", "screen.follow", "Follow the robot", "f", bars={Bar.FLEET: ("Follow", 6)}),
    ConsoleKey("+ -", "screen.zoom(1)", "Zoom in", "plus,equals_sign", bars={Bar.FLEET: ("Zoom", 6)}),
    ConsoleKey("-", "screen.zoom(-1)", "Zoom out", "minus,underscore"),
    ConsoleKey("t", "app.one_at_a_time", "Of one robot", "t,p,l,d"),
    ConsoleKey("?", "app.keys", bars={Bar.FLEET: ("Keys", 5)}),
    ConsoleKey("q", "app.quit", bars={Bar.FLEET: ("Quit", 7)}),
)
"""Keys of the fleet's screen; those without a name use the console's binding."""


def bindings(table: tuple[ConsoleKey, ...]) -> list[Binding]:
    """Create Textual's bindings from a table; our key bars show them."""
    return [Binding(each.keys, each.action, each.name, show=False, priority=each.urgent) for each in table if each.keys]


@cache
def bar(which: Bar) -> tuple[BarKey, ...]:
    """Keys of a bar, from left to right."""
    found = ((each, each.bars[which]) for each in (*TABLE, *FLEET_TABLE) if which in each.bars)
    return tuple(BarKey(each.shown, text, each.action, rank) for each, (text, rank) in found)
