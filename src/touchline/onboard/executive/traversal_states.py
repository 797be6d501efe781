"""States of a traversal, as in `TraversalStatus`, and their names."""

from __future__ import annotations

from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import TraversalStatus

IDLE, READY, RUNNING = TraversalStatus.IDLE, TraversalStatus.READY, TraversalStatus.RUNNING
PAUSED, DONE = TraversalStatus.PAUSED, TraversalStatus.DONE
ABORTED, ESTOPPED = TraversalStatus.ABORTED, TraversalStatus.ESTOPPED
NAMES = {
    IDLE: "idle",
    READY: "ready",
    RUNNING: "running",
    PAUSED: "paused",
    DONE: "done",
    ABORTED: "aborted",
    ESTOPPED: "emergency-stopped",
}


def require_state(state: int, command: str, *states: int) -> None:
    """Refuse a command that is allowed in other states only.

    Raises:
        CommandRefused: The robot is in none of `states`.
    """
    if state not in states:
        allowed = " or ".join(NAMES[each] for each in states)
        remedy = "; reset it first" if state == ESTOPPED else ""
        raise CommandRefused(f"cannot {command} while {NAMES[state]}; only while {allowed}{remedy}")
