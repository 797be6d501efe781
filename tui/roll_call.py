"""Roll call after an order to several robots: acknowledgements, refusals with reasons, and silent robots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

from textual.content import Content

from touchline.schemas.messages.touchline import TraversalStatus
from touchline.tui import format, theme
from touchline.tui.order_registry import DOUBT_S, STOPPING, Phase
from touchline.tui.robot import BUSY_STATES
from touchline.tui.state import ConsoleState

SILENT_S = 1.0
"""Time without an answer from which a robot counts as silent; a later answer still counts."""
SHOWN_S = 20.0
"""Time for which a roll call is shown after all have acknowledged."""
_LABEL = 16


class Heard(IntEnum):
    """Reply of a robot, the worst first."""

    SILENT = 0
    REFUSED = 1
    WAITING = 2
    """The answer may still come."""
    ACKNOWLEDGED = 3
    AT_REST = 4
    """The robot refuses to stop, as it is at rest."""


MARKS = {
    Heard.SILENT: theme.Badge("▲", "silent", theme.ORANGE),
    Heard.REFUSED: theme.Badge("✗", "refused", theme.ORANGE),
    Heard.WAITING: theme.Badge("…", "asked", theme.MUTED),
    Heard.ACKNOWLEDGED: theme.Badge("✓", "acknowledged", theme.GREEN),
    Heard.AT_REST: theme.Badge("○", "at rest", theme.MUTED),
}


@dataclass(frozen=True)
class RollCall:
    """Order that was sent to several robots at one time (s, of the console)."""

    order: str
    title: str
    robots: tuple[str, ...]
    at_s: float


@dataclass(frozen=True)
class RollReply:
    """Reply of one robot, with its reason."""

    heard: Heard
    reason: str = ""


def reply(roll: RollCall, state: ConsoleState) -> RollReply:
    """Evaluate the reply of a robot to the order."""
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
    """Evaluate the reply to an emergency stop, which only the status acknowledges."""
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
    """Replies by robot, in the order of the roll call."""
    return {name: reply(roll, states[name]) for name in roll.robots if name in states}


def over(roll: RollCall, heard: Mapping[str, RollReply], now_s: float) -> bool:
    """True if all robots acknowledged the order some time ago."""
    well = all(each.heard >= Heard.ACKNOWLEDGED for each in heard.values())
    return well and now_s - roll.at_s > SHOWN_S


def roll_lines(roll: RollCall, heard: Mapping[str, RollReply], width: int, height: int) -> list[Content]:
    """Lines with the counts, then robots without acknowledgement by reason, the worst first, at most `height`."""
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
    """Line with a reason, cut to leave room for the names, and the names."""
    head = format.cut(reason, max(width - min(len(names), width // 2) - 3, _LABEL))
    names = names if len(head) + 2 + len(names) <= width else names[: max(width - len(head) - 3, 0)] + "…"
    line = Content.assemble((head, color), (": ", theme.MUTED), (names, f"bold {theme.INK}"))
    return line.truncate(width, ellipsis=True)
