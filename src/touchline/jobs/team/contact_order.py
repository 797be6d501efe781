"""Contacts of a team by its robots' reported true paths, whichever of them arrives first.

Each robot's paths come by a connection of their own, so one may have reported an exchange while another's path of the
one before is still to come.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from touchline.coordination.reported_contacts import ReportedContacts, tick_of
from touchline.schemas.messages import TrueWay

LATE_S: Final = 1.0
"""Wall-clock time for which a late path is awaited: the coordinator does not wait longer for a silent robot either."""


class ContactsInOrder:
    """Evaluates one exchange after the other, each once all robots have reported it or after a timeout.

    Args:
        contacts: Counts the contacts.
        robots: Number of robots.
        clock: Monotonic seconds.
    """

    def __init__(self, contacts: ReportedContacts, robots: int, clock: Callable[[], float] = time.monotonic) -> None:
        self._contacts, self._robots, self._clock = contacts, robots, clock
        self._paths: dict[int, dict[str, TrueWay]] = {}
        self._first_s: dict[int, float] = {}

    def take(self, name: str, path: TrueWay) -> None:
        """Take a robot's reported path."""
        tick = tick_of(path)
        self._paths.setdefault(tick, {})[name] = path
        self._first_s.setdefault(tick, self._clock())

    def look(self, *, complete: bool = False) -> None:
        """Count contacts as far as is known.

        Args:
            complete: Nothing more will come.
        """
        latest_s = self._clock() - LATE_S
        for tick in sorted(self._paths):
            if not complete and len(self._paths[tick]) < self._robots and self._first_s[tick] > latest_s:
                return
            del self._first_s[tick]
            for name, path in self._paths.pop(tick).items():
                self._contacts.take(name, path)
            if tick > self._contacts.looked_tick:
                self._contacts.look(tick)
