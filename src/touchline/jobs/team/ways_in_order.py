"""Contacts of a team by the ways that its robots tell, whichever of them arrives first.

Each robot's ways come by a connection of its own, so one may have told of an exchange while another's way up to the one
before is still to come.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from touchline.fleet.told_contacts import ToldContacts, tick_of
from touchline.schemas.messages import TrueWay

LATE_S: Final = 1.0
"""Wall time that a way may take longer than another's: nor does the coordinator wait longer for who is silent."""


class WaysInOrder:
    """Looks at one exchange after the other, each once all have told of it or have had their time.

    Args:
        told: Counts the contacts.
        robots: How many there are.
        clock: Monotonic seconds.
    """

    def __init__(self, told: ToldContacts, robots: int, clock: Callable[[], float] = time.monotonic) -> None:
        self._told, self._robots, self._clock = told, robots, clock
        self._ways: dict[int, dict[str, TrueWay]] = {}
        self._first_s: dict[int, float] = {}

    def take(self, name: str, way: TrueWay) -> None:
        """Take what a robot has told."""
        tick = tick_of(way)
        self._ways.setdefault(tick, {})[name] = way
        self._first_s.setdefault(tick, self._clock())

    def look(self, *, all_told: bool = False) -> None:
        """Count contacts as far as is known.

        Args:
            all_told: Nothing more will come.
        """
        latest_s = self._clock() - LATE_S
        for tick in sorted(self._ways):
            if not all_told and len(self._ways[tick]) < self._robots and self._first_s[tick] > latest_s:
                return
            del self._first_s[tick]
            for name, way in self._ways.pop(tick).items():
                self._told.take(name, way)
            if tick > self._told.looked_tick:
                self._told.look(tick)
