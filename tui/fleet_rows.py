"""Rows and totals of the list of all robots, as data."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

from touchline.schemas.messages.touchline import TraversalStatus
from touchline.schemas.plain_text import plain
from touchline.tui import theme
from touchline.tui.alerts import alerts, is_over
from touchline.tui.node_health import Freshness, silence
from touchline.tui.order_registry import Phase
from touchline.tui.robots import Robots
from touchline.tui.roll_call import Heard, RollReply
from touchline.tui.state import ConsoleState
from touchline.tui.unfinished_job import offered, share_done

GONE = theme.Badge("✗", "GONE", theme.VERMILION)
SILENT = theme.Badge("▲", "SILENT", theme.ORANGE)


class Trouble(IntEnum):
    """Urgency with which a robot needs an operator, the highest first."""

    STOP_UNHEARD = 0
    """It has not acknowledged an emergency stop."""
    SILENT = 1
    GONE = 2
    UNANSWERED = 3
    """It has not acknowledged the last order to several."""
    HALTED = 4
    ALERT = 5
    """Alert that does not stop the robot yet."""
    WAITING = 6
    NONE = 7


@dataclass(frozen=True)
class FleetRow:
    """Row of a robot; figures are None where they are unknown.

    Attributes:
        name: Namespace of the robot.
        badge: State of the robot.
        doubtful: Whether the figures are old.
        battery: Charge 0…1.
        progress: Covered share 0…1 of a job, driven share of a drive.
        speed_mps: Estimated speed.
        off_m: 3σ of the estimated position.
        alert: Alert for the operator.
        grave: Whether it keeps the robot from its work.
        trouble: Urgency, the sort key.
        elsewhere: Whether the robot's map frame has another origin than that of the robot in view.
    """

    name: str
    badge: theme.Badge
    doubtful: bool
    battery: float | None
    progress: float | None
    speed_mps: float | None
    off_m: float | None
    alert: str
    grave: bool
    trouble: Trouble
    elsewhere: bool = False


def fleet_rows(robots: Robots, *, by_trouble: bool = True) -> list[FleetRow]:
    """Create the rows of all robots, those that need an operator first, else by name."""
    heard, here = robots.answers(), robots.selected
    rows = [_row(name, state, heard.get(name), here) for name, state in robots.states.items()]
    return sorted(rows, key=lambda row: (row.trouble if by_trouble else 0, name_key(row.name)))


def name_key(name: str) -> tuple[tuple[int, str], ...]:
    """Sort key that puts r2 before r10."""
    parts: list[str] = []
    for character in name:
        if parts and parts[-1][-1].isdigit() == character.isdigit():
            parts[-1] += character
        else:
            parts.append(character)
    return tuple((int(part), "") if part.isdecimal() else (-1, part) for part in parts)


def elsewhere(state: ConsoleState, here: ConsoleState) -> bool:
    """True if a robot's map frame has another origin than that of `here`."""
    return state.origin is not None and here.origin is not None and state.origin != here.origin


def _row(name: str, state: ConsoleState, answer: RollReply | None, here: ConsoleState) -> FleetRow:
    trouble, alert = _trouble(state, answer)
    robot, status = state.robot, state.robot.status
    battery = robot.battery.percentage if robot.battery is not None else None
    return FleetRow(
        name=name,
        badge=_badge(state),
        doubtful=not state.robot_alive or state.robot_stale,
        battery=battery if battery is not None and math.isfinite(battery) else None,
        progress=state.share_done,
        speed_mps=status.speed_mps if status is not None and state.busy else None,
        off_m=robot.spread.long_m if robot.spread is not None else None,
        alert=alert,
        grave=trouble < Trouble.ALERT,
        trouble=trouble,
        elsewhere=elsewhere(state, here),
    )


def _badge(state: ConsoleState) -> theme.Badge:
    freshness = state.robot_freshness
    if freshness is Freshness.GONE:
        return GONE if _seen(state) else theme.NO_ROBOT
    if freshness is Freshness.STALE:
        return SILENT
    if state.replayed and state.replay.paused:
        return theme.STATES[TraversalStatus.PAUSED]
    return theme.STARTING if state.traversal is None else theme.STATES[state.traversal]


def _seen(state: ConsoleState) -> bool:
    return state.robot_node.seen


def _trouble(state: ConsoleState, answer: RollReply | None) -> tuple[Trouble, str]:
    """Urgency and reason with which a robot needs an operator."""
    freshness, stop = state.robot_freshness, state.orders.stop
    if stop.phase is Phase.SENT:
        line = stop.line(state.now_s, "" if state.traversal is None else _badge(state).text)
        return Trouble.STOP_UNHEARD, line.text if line is not None else ""
    if freshness is Freshness.STALE:
        was = "" if state.traversal is None else f", was {theme.STATES[state.traversal].text}"
        return Trouble.SILENT, silence(state.robot_silence_s) + was
    if freshness is Freshness.GONE:
        words = "gone amid its job" if state.lost_job else "its process has gone"
        return (Trouble.GONE, words) if _seen(state) else (Trouble.WAITING, "never seen")
    if answer is not None and answer.heard in (Heard.SILENT, Heard.REFUSED):
        return Trouble.UNANSWERED, answer.reason
    return _work_trouble(state)


def _work_trouble(state: ConsoleState) -> tuple[Trouble, str]:
    """Urgency and reason of a robot that reports."""
    if state.replayed:
        return Trouble.NONE, state.replay.mark
    found, status = alerts(state), state.robot.status
    if status is None or state.robot_freshness is Freshness.STARTING:
        return Trouble.WAITING, state.robot_node.message
    reason = "" if is_over(state, status.reason) else plain(status.reason)
    if state.paused_by_hand and not (found and found[0].stops):
        return Trouble.WAITING, reason
    if (job := offered(state)) is not None and state.traversal != TraversalStatus.READY:
        return Trouble.HALTED, f"{share_done(state, job)}, g goes on: {plain(job.reason)}"
    if state.traversal in (TraversalStatus.PAUSED, TraversalStatus.ESTOPPED, TraversalStatus.ABORTED):
        return Trouble.HALTED, found[0].text if found and found[0].stops else reason
    if state.lost_job:
        return Trouble.HALTED, "restarted amid its job, which it has lost"
    if found:
        return Trouble.ALERT, found[0].text
    warning = state.log.last_warning
    return Trouble.NONE, "" if warning is None else warning.text


@dataclass(frozen=True)
class FleetTotals:
    """Number of robots in all and by state; `least_battery` is (charge 0…1, name)."""

    robots: int
    running: int
    paused: int
    stopped: int
    silent: int
    gone: int
    least_battery: tuple[float, str] | None


def totals(states: Mapping[str, ConsoleState]) -> FleetTotals:
    """Count all robots by state."""
    live = [state for state in states.values() if state.robot_alive and not state.robot_stale]
    doing = [state.traversal for state in live]
    charges = [
        (state.robot.battery.percentage, name)
        for name, state in states.items()
        if state.robot_alive and state.robot.battery is not None and math.isfinite(state.robot.battery.percentage)
    ]
    return FleetTotals(
        robots=len(states),
        running=doing.count(TraversalStatus.RUNNING),
        paused=doing.count(TraversalStatus.PAUSED),
        stopped=doing.count(TraversalStatus.ESTOPPED) + doing.count(TraversalStatus.ABORTED),
        silent=sum(state.robot_stale for state in states.values()),
        gone=sum(not state.robot_alive for state in states.values()),
        least_battery=min(charges, default=None),
    )
