"""Table of the console's keys, from which bindings, key bars, command palette and the list of keys are made."""

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


class Group(Enum):
    """Groups of the list of keys, in its order."""

    ROBOT = "Robot"
    JOB = "Job"
    WAY = "Way"
    ALL = "All"
    GOAL = "Goal"
    STOP = "Stop"
    TIME = "Time"
    REPLAY = "Replay"
    LIST = "List"
    MAP = "Map"
    FLEET = "Fleet"
    CONSOLE = "Console"


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
        group: Group in the list of keys, which shows `about` or else `name`; None for a key that another row lists.
    """

    shown: str
    action: str
    name: str = ""
    keys: str = ""
    about: str = ""
    bars: Mapping[Bar, tuple[str, int]] = field(default_factory=dict)
    urgent: bool = False
    group: Group | None = None


TABLE = (
    ConsoleKey(
        *("e", "estop", "Emergency stop", "e", "Stop all robots at once"),
        {Bar.JOB: ("E-STOP", 0), Bar.AIM: ("E-STOP", 0), Bar.REPLAY: ("E-STOP", 0)},
        group=Group.STOP,
    ),
    ConsoleKey("ctrl+e", "estop", "The same, in dialogs, too", "ctrl+e", urgent=True, group=Group.STOP),
    ConsoleKey(
        *("enter", "aim('go')", "Preview the drive, then drive", "enter"), bars={Bar.AIM: ("Go", 1)}, group=Group.GOAL
    ),
    ConsoleKey("arrows", "keys", "Move the goal, finely with Shift", bars={Bar.AIM: ("Place", 2)}, group=Group.GOAL),
    ConsoleKey("drag", "", "Set the goal, and its heading", group=Group.GOAL),
    ConsoleKey(
        *("< >", "turn(1)", "Turn the goal left and right", "less_than_sign"),
        bars={Bar.AIM: ("Turn", 1)}, group=Group.GOAL,
    ),
    ConsoleKey(">", "turn(-1)", "Turn the goal right", "greater_than_sign"),
    ConsoleKey("h", "aim('free')", "Any heading", "h", bars={Bar.AIM: ("Any heading", 1)}, group=Group.GOAL),
    ConsoleKey("m", "aim('how')", "How to drive there", "m", bars={Bar.AIM: ("How", 1)}, group=Group.GOAL),
    ConsoleKey("esc", "aim('leave')", "Aim no longer", "escape", bars={Bar.AIM: ("Leave", 1)}, group=Group.GOAL),
    ConsoleKey(
        *("1", "command('wait_on')", "Wait on", "1", "Before something in its way: wait until it has gone"),
        {Bar.JOB: ("Wait on", 1)}, group=Group.WAY,
    ),
    ConsoleKey(
        *("2", "command('go_round')", "Go round", "2", "Go round what is in its way now"),
        {Bar.JOB: ("Go round", 1)}, group=Group.WAY,
    ),
    ConsoleKey(
        *("3", "command('leave_out')", "Leave out", "3", "Go round, and leave out for good what is beside it"),
        {Bar.JOB: ("Leave out", 1)}, group=Group.WAY,
    ),
    ConsoleKey(
        *("t", "template", "Choose template", "t", "Choose a shipped template or a file"),
        {Bar.JOB: ("Template", 1)}, group=Group.JOB,
    ),
    ConsoleKey(
        "p", "plan", "Plan", "p", "Plan the path for the template", {Bar.JOB: ("Plan", 1)}, group=Group.JOB
    ),
    ConsoleKey(
        "l", "load", "Load", "l", "Load the plan into the robot", {Bar.JOB: ("Load", 1)}, group=Group.JOB
    ),
    ConsoleKey("s", "command('start')", "Start", "s", "Start the job", {Bar.JOB: ("Start", 1)}, group=Group.JOB),
    ConsoleKey(
        *("space", "command('pause')", "Pause", "space", "Stop where it is; resume goes on"),
        {Bar.JOB: ("Pause", 1), Bar.REPLAY: ("Pause/go on", 1)},
        group=Group.JOB,
    ),
    ConsoleKey(
        *("g", "command('resume')", "Go on", "g", "Resume after a pause; or an unfinished job"),
        {Bar.JOB: ("Go on", 1)}, group=Group.JOB,
    ),
    ConsoleKey("g", "go_on", "Go on with the job", about="Do what an abort or a restart of the robot left"),
    ConsoleKey("a", "abort", "Abort", "a", "Give up the job (asks first)", {Bar.JOB: ("Abort", 1)}, group=Group.JOB),
    ConsoleKey(
        *("r", "command('reset')", "Reset", "r", "Make ready again after a stop or an abort"),
        {Bar.JOB: ("Reset", 1)}, group=Group.JOB,
    ),
    ConsoleKey(
        *("u", "command('refill')", "Refill tank", "u", "The tank has been filled up"),
        {Bar.JOB: ("Refill", 1)}, group=Group.JOB,
    ),
    ConsoleKey(
        *("b", "command('battery')", "Replace battery", "b", "A full battery has been put in"),
        {Bar.JOB: ("Battery", 1)},
        group=Group.JOB,
    ),
    ConsoleKey(
        *("d", "drive", "Drive to a goal", "d", "Drive to a goal: aim on the map, preview, drive"),
        {Bar.JOB: ("Drive to", 1)}, group=Group.JOB,
    ),
    ConsoleKey("< >", "seek(10)", "10 s back and on", bars={Bar.REPLAY: ("10 s", 1)}, group=Group.REPLAY),
    ConsoleKey("<", "seek(-10)", "Replay: 10 s back", "less_than_sign"),
    ConsoleKey(">", "seek(10)", "Replay: 10 s on", "greater_than_sign"),
    ConsoleKey("{", "seek(-60)", "Replay: a minute back", "left_curly_bracket"),
    ConsoleKey(
        *("{ }", "seek(60)", "A minute back and on", "right_curly_bracket"),
        bars={Bar.REPLAY: ("1 min", 2)}, group=Group.REPLAY,
    ),
    ConsoleKey("n", "step", "A step of 0.1 s", "n", bars={Bar.REPLAY: ("Step", 1)}, group=Group.REPLAY),
    ConsoleKey(
        "[ ]", "speed(1)", "Slower and faster, also , and .", "right_square_bracket,full_stop",
        bars={Bar.JOB: ("Speed", 1), Bar.REPLAY: ("Speed", 1)}, group=Group.TIME,
    ),
    ConsoleKey("[", "speed(-1)", "Slower", "left_square_bracket,comma"),
    ConsoleKey(
        *("v", "fleet", "Fleet", "v", "All robots on one screen"),
        {Bar.JOB: ("Fleet", 1), Bar.REPLAY: ("Fleet", 2)}, group=Group.FLEET,
    ),
    ConsoleKey(
        *("o", "next_robot", "Other robot", "o", "Bring the next robot into view"),
        {Bar.JOB: ("Other robot", 1), Bar.REPLAY: ("Other robot", 2)},
        group=Group.FLEET,
    ),
    ConsoleKey(
        *("x", "order_all", "Order to all", "x", "Pause, resume, abort or reset all robots (asks first)"),
        {Bar.JOB: ("All…", 3)}, group=Group.FLEET,
    ),
    ConsoleKey(
        *("f", "follow", "Follow the robot", "f", "Keep the robot in the middle of the map"),
        {Bar.JOB: ("Follow", 3), Bar.REPLAY: ("Follow", 3)},
        group=Group.MAP,
    ),
    ConsoleKey(
        *("0", "fit", "Show the whole job", "0,home", "Show the whole job, also home"),
        {Bar.JOB: ("Fit", 4), Bar.REPLAY: ("Fit", 4)}, group=Group.MAP,
    ),
    ConsoleKey(
        "+ -", "zoom(1)", "Zoom, also the wheel", "plus,equals_sign",
        bars={Bar.JOB: ("Zoom", 5), Bar.AIM: ("Zoom", 3), Bar.REPLAY: ("Zoom", 5)}, group=Group.MAP,
    ),
    ConsoleKey("arrows", "", "Pan, also by dragging", group=Group.MAP),
    ConsoleKey("-", "zoom(-1)", "Zoom out", "minus,underscore"),
    ConsoleKey("space", "command('pause')", bars={Bar.AIM: ("Pause", 1)}),
    ConsoleKey(
        *("?", "keys", "Keys", "question_mark", "List all keys"),
        {Bar.JOB: ("Keys", 2), Bar.AIM: ("Keys", 3), Bar.REPLAY: ("Keys", 2)},
        group=Group.CONSOLE,
    ),
    ConsoleKey("tab", "", "Next panel", group=Group.CONSOLE),
    ConsoleKey("^p", "command_palette", "All commands by name", bars={Bar.JOB: ("Commands", 6)}, group=Group.CONSOLE),
    ConsoleKey(
        *("q", "quit", "Quit", "q", "Leave the console"),
        {Bar.JOB: ("Quit", 7), Bar.REPLAY: ("Quit", 7)}, group=Group.CONSOLE,
    ),
)  # fmt: skip
FLEET_TABLE = (
    ConsoleKey("arrows", "", "Pick a robot, also by a click", group=Group.ROBOT),
    ConsoleKey("e", "app.estop", bars={Bar.FLEET: ("E-STOP", 0)}, group=Group.STOP),
    ConsoleKey("ctrl+e", "", "The same, in dialogs, too", group=Group.STOP),
    ConsoleKey(
        "enter", "screen.leave", "Show the robot alone, also a second click", bars={Bar.FLEET: ("Show", 1)},
        group=Group.ROBOT,
    ),
    ConsoleKey("x", "app.order_all", bars={Bar.FLEET: ("All…", 1)}, group=Group.ALL),
    ConsoleKey("space", "app.command('pause')", bars={Bar.FLEET: ("Pause", 2)}, group=Group.ROBOT),
    ConsoleKey("g", "app.command('resume')", bars={Bar.FLEET: ("Resume", 2)}, group=Group.ROBOT),
    ConsoleKey("a", "app.abort", bars={Bar.FLEET: ("Abort", 3)}, group=Group.ROBOT),
    ConsoleKey("r", "app.command('reset')", bars={Bar.FLEET: ("Reset", 3)}, group=Group.ROBOT),
    ConsoleKey("o", "app.next_robot", group=Group.ROBOT),
    ConsoleKey("esc", "screen.back", "Put answers away, then back to one robot", "escape", group=Group.CONSOLE),
    ConsoleKey("v", "screen.leave", "Back to one robot", "v", group=Group.CONSOLE),
    ConsoleKey(
        "n", "screen.sort", "Sort by name, or those in trouble first", "n", bars={Bar.FLEET: ("Sort", 4)},
        group=Group.LIST,
    ),
    ConsoleKey(
        "m", "screen.shown", "Map and list, list, or map", "m", bars={Bar.FLEET: ("Map/list", 4)}, group=Group.LIST
    ),
    ConsoleKey("k", "screen.tasks", "Show or hide the team's tasks, if it has any", "k", group=Group.LIST),
    ConsoleKey("0", "screen.fit", "Show all robots", "0", bars={Bar.FLEET: ("Fit", 5)}, group=Group.MAP),
    ConsoleKey("f", "screen.follow", "Follow the robot", "f", bars={Bar.FLEET: ("Follow", 6)}, group=Group.MAP),
    ConsoleKey(
        "+ -", "screen.zoom(1)", "Zoom, also the wheel; drag to pan", "plus,equals_sign", bars={Bar.FLEET: ("Zoom", 6)},
        group=Group.MAP,
    ),
    ConsoleKey("-", "screen.zoom(-1)", "Zoom out", "minus,underscore"),
    ConsoleKey("t", "app.one_at_a_time", "Of one robot", "t,p,l,d"),
    ConsoleKey("?", "app.keys", bars={Bar.FLEET: ("Keys", 5)}, group=Group.CONSOLE),
    ConsoleKey("^p", "app.command_palette", group=Group.CONSOLE),
    ConsoleKey("q", "app.quit", bars={Bar.FLEET: ("Quit", 7)}, group=Group.CONSOLE),
)  # fmt: skip
"""Keys of the fleet's screen; those without a name use the console's binding."""


def bindings(table: tuple[ConsoleKey, ...]) -> list[Binding]:
    """Create Textual's bindings from a table; our key bars show them."""
    return [Binding(each.keys, each.action, each.name, show=False, priority=each.urgent) for each in table if each.keys]


@cache
def bar(which: Bar) -> tuple[BarKey, ...]:
    """Keys of a bar, from left to right."""
    found = ((each, each.bars[which]) for each in (*TABLE, *FLEET_TABLE) if which in each.bars)
    return tuple(BarKey(each.shown, text, each.action, rank) for each, (text, rank) in found)


def listed(table: tuple[ConsoleKey, ...]) -> list[tuple[str, str, str]]:
    """List the keys of a table by their groups: group, key, effect."""
    found = [(each.group.value, each.shown, _effect(each)) for group in Group for each in table if each.group is group]
    assert all(effect for _, _, effect in found)
    return found


def _effect(key: ConsoleKey) -> str:
    if key.about or key.name:
        return key.about or key.name
    action = key.action.removeprefix("app.")
    return next((each.about for each in TABLE if each.action == action and each.about), "") or next(
        (each.name for each in TABLE if each.action == action), ""
    )
