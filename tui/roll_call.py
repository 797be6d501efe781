"""Roll call after an order to several robots: who has acknowledged it, who refuses and why, and who is silent."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

from textual.content import Content

from touchline.schemas.messages.touchline import TraversalStatus
from touchline.tui import format, theme
from touchline.tui.order_book import DOUBT_S, STOPPING, Phase
from touchline.tui.robot import BUSY_STATES
from touchline.tui.state import ConsoleState

SILENT_S = 1.0
"""Who has not answered for so long is silent; an answer that comes later still counts."""
SHOWN_S = 20.0
"""So long a roll call of which all is well is shown."""
_LABEL = 16


class Heard(IntEnum):
    """What was heard of a robot, the worst first."""

    SILENT = 0
    REFUSED = 1
    WAITING = 2
    """Its answer may still be on its way."""
    ACKNOWLEDGED = 3
    AT_REST = 4
    """It refuses to stop, as it does not drive."""


MARKS = {
    Heard.SILENT: theme.Badge("▲", "silent", theme.ORANGE),
    Heard.REFUSED: theme.Badge("✗", "refused", theme.ORANGE),
    Heard.WAITING: theme.Badge("…", "asked", theme.MUTED),
    Heard.ACKNOWLEDGED: theme.Badge("✓", "acknowledged", theme.GREEN),
    Heard.AT_REST: theme.Badge("○", "at rest", theme.MUTED),
}


@dataclass(frozen=True)
class RollCall:
    """An order that was given to these robots at one time (s, of the console)."""

    order: str
    title: str
    robots: tuple[str, ...]
    at_s: float


@dataclass(frozen=True)
class RollReply:
    """What one robot has made of it, and its reason."""

    heard: Heard
    reason: str = ""


def reply(roll: RollCall, state: ConsoleState) -> RollReply:
    """What this robot has made of the order."""
    if roll.order == "estop":
        return _stop_reply(roll, state)
    if roll.order == "pause" and state.paused_by_hand:
        return RollReply(Heard.ACKNOWLEDGED)
    placed = state.orders.latest(roll.order)
    if placed is None or placed.word is None:
        return _unanswered(roll, state)
    if not placed.answered:
        return RollReply(Heard.SILENT, placed.word.text)
    if not placed.accepted:
        rests = roll.order in STOPPING and state.traversal not in BUSY_STATES and not state.robot_stale
        return RollReply(Heard.AT_REST) if rests else RollReply(Heard.REFUSED, placed.word.text)
    runs = state.traversal == TraversalStatus.RUNNING and not state.robot_stale
    if roll.order in STOPPING and runs and state.now_s - placed.at_s > DOUBT_S:
        return RollReply(Heard.REFUSED, "acknowledged, but says RUNNING")
    return RollReply(Heard.ACKNOWLEDGED)


def _stop_reply(roll: RollCall, state: ConsoleState) -> RollReply:
    """Only its status acknowledges an emergency stop."""
    stop = state.orders.stop
    if stop.phase is Phase.HELD:
        return RollReply(Heard.ACKNOWLEDGED)
    if stop.phase is Phase.OFF:
        return RollReply(Heard.ACKNOWLEDGED, "reset since")
    if stop.answer and state.robot_alive and not state.robot_stale and state.now_s - roll.at_s > SILENT_S:
        return RollReply(Heard.REFUSED, f"answered, but says {_state_text(state)}: repeated")
    return _unanswered(roll, state)


def _state_text(state: ConsoleState) -> str:
    return theme.WAITING.text if state.traversal is None else theme.STATES[state.traversal].text


def _unanswered(roll: RollCall, state: ConsoleState) -> RollReply:
    if not state.robot_alive:
        return RollReply(Heard.SILENT, "not on the bus")
    if state.now_s - roll.at_s > SILENT_S:
        return RollReply(Heard.SILENT, "no answer")
    return RollReply(Heard.WAITING)


def replies(roll: RollCall, states: Mapping[str, ConsoleState]) -> dict[str, RollReply]:
    """By robot, in the order in which they were asked."""
    return {name: reply(roll, states[name]) for name in roll.robots if name in states}


def over(roll: RollCall, heard: Mapping[str, RollReply], now_s: float) -> bool:
    """Whether everybody has acknowledged, and long enough ago not to be of interest any more."""
    well = all(each.heard >= Heard.ACKNOWLEDGED for each in heard.values())
    return well and now_s - roll.at_s > SHOWN_S


def roll_lines(roll: RollCall, heard: Mapping[str, RollReply], width: int, height: int) -> list[Content]:
    """The count, then whoever has not acknowledged, by reason, the worst first, in at most `height` lines."""
    groups: dict[RollReply, list[str]] = {}
    for name, each in heard.items():
        groups.setdefault(each, []).append(name)
    counts = [sum(each.heard is kind for each in heard.values()) for kind in Heard]
    parts = [
        (f"   {count} {MARKS[kind].mark} {MARKS[kind].text}", MARKS[kind].color)
        for kind, count in sorted(zip(Heard, counts, strict=True), key=lambda each: -min(each[0], Heard.ACKNOWLEDGED))
        if count
    ]
    count = Content.assemble((f" {roll.title} to {len(heard)}:", f"bold {theme.INK}"), *parts)
    lines = [count.truncate(width, ellipsis=True)]
    open_groups = sorted((each for each in groups if each.heard < Heard.WAITING), key=lambda each: each.heard)
    for each in open_groups[: height - 1]:
        mark, names = MARKS[each.heard], ", ".join(groups[each])
        lines.append(_group_line(f" {mark.mark} {each.reason}", names, mark.color, width))
    if len(open_groups) > height - 1 > 0:
        names = ", ".join(name for each in open_groups[height - 2 :] for name in groups[each])
        lines[-1] = _group_line(" ▲ other reasons", names, theme.ORANGE, width)
    return lines


def _group_line(reason: str, names: str, color: str, width: int) -> Content:
    """A reason, cut where it leaves the names no room, and the names."""
    head = format.cut(reason, max(width - min(len(names), width // 2) - 3, _LABEL))
    names = names if len(head) + 2 + len(names) <= width else names[: max(width - len(head) - 3, 0)] + "…"
    line = Content.assemble((head, color), (": ", theme.MUTED), (names, f"bold {theme.INK}"))
    return line.truncate(width, ellipsis=True)
