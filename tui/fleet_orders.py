"""Orders to all robots: recipients of each, and the question before it is sent."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from touchline.schemas.messages.touchline import TraversalStatus
from touchline.tui import theme
from touchline.tui.order_registry import Phase
from touchline.tui.state import ConsoleState


@dataclass(frozen=True)
class FleetOrder:
    """Order of `orders.COMMANDS` for all robots for which `concerns` is true.

    Stopping orders go to every robot that is there, also to silent ones. Orders that set in motion go only to robots
    that report now that they wait for it: a silent one might move off whenever it receives it.
    """

    name: str
    title: str
    key: str
    whom: str
    concerns: Callable[[ConsoleState], bool]


def _there(state: ConsoleState) -> bool:
    return state.robot_alive and not state.replayed


def _paused(state: ConsoleState) -> bool:
    return state.traversal == TraversalStatus.PAUSED and not state.robot_stale and not state.replayed


def _stopped(state: ConsoleState) -> bool:
    """True for a stopped or aborted robot, without an emergency stop under way, which a reset would withdraw."""
    ended = state.traversal in (TraversalStatus.ESTOPPED, TraversalStatus.ABORTED) and not state.robot_stale
    return ended and state.orders.stop.phase is not Phase.SENT and not state.replayed


FLEET_ORDERS = (
    FleetOrder("pause", "Pause", "space", "all that are there", _there),
    FleetOrder("resume", "Resume", "g", "those that are paused", _paused),
    FleetOrder("abort", "Abort", "a", "all that are there", _there),
    FleetOrder("reset", "Reset", "r", "those that are stopped or aborted", _stopped),
)


def concerned(order: FleetOrder, states: Mapping[str, ConsoleState]) -> tuple[str, ...]:
    """Names of the robots that an order goes to."""
    return tuple(name for name, state in states.items() if order.concerns(state))


def census(states: Mapping[str, ConsoleState]) -> str:
    """Summarise the robots' states: 37 RUNNING, 2 PAUSED, 1 silent."""
    counts = Counter(_doing(state) for state in states.values())
    return ", ".join(f"{count} {doing}" for doing, count in counts.most_common())


def _doing(state: ConsoleState) -> str:
    if state.replayed:
        return "replayed"
    if not state.robot_alive:
        return "not on the bus"
    if state.robot_stale:
        return "silent"
    return "starting" if state.traversal is None else theme.STATES[state.traversal].text
