"""Which commands the robot has obeyed, and after which tick: with its setup and plan, all that decides a session."""

from __future__ import annotations

import json
from typing import Any, NamedTuple


class ObeyedOrder(NamedTuple):
    """A command that was obeyed.

    Attributes:
        tick: The last one before it.
        name: Of the command.
        details_json: What belongs to it, a JSON object.
    """

    tick: int
    name: str
    details_json: str


class OrderLog:
    """The orders since they were told last.

    Attributes:
        count: Of all orders so far.
    """

    def __init__(self) -> None:
        """None yet."""
        self._waiting: list[ObeyedOrder] = []
        self.count = 0

    def note(self, tick: int, name: str, **details: Any) -> None:
        """An order was obeyed, with these details (values as in JSON)."""
        text = json.dumps(details, separators=(",", ":")) if details else "{}"
        self.count += 1
        self._waiting.append(ObeyedOrder(tick, name, text))

    def take(self) -> list[ObeyedOrder]:
        """Those since the last call."""
        if not self._waiting:
            return []
        taken, self._waiting = self._waiting, []
        return taken
