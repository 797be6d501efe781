"""Log of the commands that can have changed the robot, with ticks; with setup and plan they determine a session."""

from __future__ import annotations

import json
from typing import Any, NamedTuple


class ObeyedOrder(NamedTuple):
    """A command that was carried out, or a resume that a pausing robot has refused.

    Attributes:
        tick: Last tick before it.
        name: Name of the command.
        details_json: Its details, a JSON object.
    """

    tick: int
    name: str
    details_json: str


class OrderLog:
    """Orders since they were last published.

    Attributes:
        count: Number of all orders so far.
    """

    def __init__(self) -> None:
        """Begin without orders."""
        self._waiting: list[ObeyedOrder] = []
        self.count = 0

    def note(self, tick: int, name: str, **details: Any) -> None:
        """Add an order.

        Args:
            tick: Last tick before it.
            name: Name of the command.
            details: Its details (values as in JSON).
        """
        text = json.dumps(details, separators=(",", ":")) if details else "{}"
        self.count += 1
        self._waiting.append(ObeyedOrder(tick, name, text))

    def take(self) -> list[ObeyedOrder]:
        """Return and clear the orders since the last call."""
        if not self._waiting:
            return []
        taken, self._waiting = self._waiting, []
        return taken
