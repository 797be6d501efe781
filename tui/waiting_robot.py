"""A robot that waits before something in its way: what it can be told, and when it goes round."""

from __future__ import annotations

from touchline.schemas.messages.touchline import PauseStatus, TraversalStatus
from touchline.schemas.messages.way_round_messages import WayRound
from touchline.tui.robot import seconds
from touchline.tui.state import ConsoleState


def blocked(state: ConsoleState) -> bool:
    """True if the robot pauses because of something in its way."""
    return state.traversal == TraversalStatus.PAUSED and state.robot.pause.cause == PauseStatus.IN_THE_WAY


def asks_way(state: ConsoleState) -> bool:
    """True if the robot waits before something and can be told to wait on, to go round, or to leave out."""
    return blocked(state) and _waits(state) and not state.robot_stale


def goes_round_in_s(state: ConsoleState) -> float | None:
    """Wall-clock time (s) until the waiting robot goes round, or searches again; None if it does neither by itself."""
    at_s, now_s = seconds(state.robot.way_round.goes_round_at), state.robot.sim_time_s
    if not blocked(state) or not _waits(state) or at_s == 0.0 or now_s is None:
        return None
    return max(at_s - now_s, 0.0) / max(state.pace, 1e-3)


def waits_on(state: ConsoleState) -> bool:
    """True if the robot waits until its way is clear, however long that takes."""
    return asks_way(state) and state.robot.way_round.state == WayRound.WAITS and goes_round_in_s(state) is None


def _waits(state: ConsoleState) -> bool:
    return state.robot.way_round.state in (WayRound.WAITS, WayRound.FINDS_NO_WAY)
