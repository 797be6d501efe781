"""Contacts of emulated robots, by the true paths that they report at every exchange in lockstep."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from touchline.coordination.body_contacts import BodyContacts
from touchline.coordination.free_area import FreeArea
from touchline.schemas.messages import BatteryState, TrueWay


class ReportedContacts:
    """Counter of contacts from reported paths.

    Attributes:
        contacts: Contacts so far, robots by their numbers.
        looked_tick: Tick up to which contacts were counted.
    """

    def __init__(self, names: Collection[str], body_radius_m: float, area: FreeArea) -> None:
        """Start without reports.

        Args:
            names: Names of all robots.
            body_radius_m: Radius of each.
            area: Area with walls.
        """
        self._names = tuple(sorted(names))
        self.contacts = BodyContacts(len(self._names), body_radius_m, area)
        self.looked_tick = 0
        self._paths: dict[str, TrueWay] = {}

    def take(self, name: str, path: TrueWay) -> None:
        """Take a robot's reported path."""
        self._paths[name] = path

    def leave(self, name: str) -> None:
        """Remove a robot, which has left the field."""
        self._paths.pop(name, None)

    def look(self, tick: int) -> tuple[str, ...]:
        """Count contacts up to a tick; return the robots that newly touch another or a wall since the last call.

        A robot that has not reported these ticks stands where it was last, or was never seen.
        """
        places = np.full((tick - self.looked_tick, len(self._names), 2), np.nan)
        for k, name in enumerate(self._names):
            if (path := self._paths.get(name)) is None:
                continue
            own = np.column_stack((path.x_m, path.y_m))
            fresh = tick_of(path) == tick and len(own) == len(places)
            places[:, k] = own if fresh else own[-1:]
        self.looked_tick = tick
        return tuple(self._names[k] for k in sorted(self.contacts.look(places)))


def tick_of(message: TrueWay | BatteryState) -> int:
    """Return the last tick of a message."""
    stamp = message.header.stamp
    return 100 * stamp.sec + stamp.nanosec // 10_000_000
