"""Void questions about a robot's motion: a late answer must not move it."""

from __future__ import annotations

from collections.abc import Callable, Collection

from touchline.schemas.messages.touchline import TraversalStatus
from touchline.tui import theme
from touchline.tui.order_registry import Phase
from touchline.tui.robot import BUSY_STATES
from touchline.tui.state import ConsoleState
from touchline.tui.unfinished_job import OFFERED_STATES

TO_START: Collection[int] = (TraversalStatus.READY,)
TO_LOAD: Collection[int] = OFFERED_STATES
TO_ABORT: Collection[int] = (TraversalStatus.READY, *BUSY_STATES)


def why_void(state: ConsoleState, during: Collection[int]) -> Callable[[], str]:
    """Create a function that returns why a question, asked now, is void; "" while it is not.

    Args:
        state: State of the robot in question.
        during: States of the traversal in which the question makes sense; in others the robot refuses the order itself.
    """
    publisher, asked_in = state.publisher, state.traversal

    def reason() -> str:
        if state.orders.stop.phase is not Phase.OFF or state.traversal == TraversalStatus.ESTOPPED:
            return "emergency stop"
        if not state.robot_alive:
            return "the robot has gone"
        if state.robot_stale and TraversalStatus.RUNNING not in during:
            return "nothing is heard of the robot"
        if publisher and state.publisher != publisher:
            return "the robot was restarted"
        if state.traversal != asked_in and state.traversal is not None and state.traversal not in during:
            return f"the robot is {theme.STATES[state.traversal].text}"
        return ""

    return reason
