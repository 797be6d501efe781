"""Which emulated robots touch each other, by the ways that they tell to have come at every exchange in lockstep."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from touchline.fleet.body_contacts import BodyContacts
from touchline.fleet.free_area import FreeArea
from touchline.schemas.messages import TrueWay


class ToldContacts:
    """See the module.

    Attributes:
        contacts: So far, robots by their numbers.
        looked_tick: Up to which it was looked.
    """

    def __init__(self, names: Collection[str], body_radius_m: float, area: FreeArea) -> None:
        """Nobody has told anything.

        Args:
            names: Of all robots.
            body_radius_m: Of each.
            area: Between whose walls they drive.
        """
        self._names = tuple(sorted(names))
        self.contacts = BodyContacts(len(self._names), body_radius_m, area)
        self.looked_tick = 0
        self._ways: dict[str, TrueWay] = {}

    def take(self, name: str, way: TrueWay) -> None:
        """Take what a robot has told."""
        self._ways[name] = way

    def leave(self, name: str) -> None:
        """A robot is not there any more."""
        self._ways.pop(name, None)

    def look(self, tick: int) -> tuple[str, ...]:
        """Count contacts up to a tick; returns the robots that have come to touch another or a wall since then.

        Who has not told of these ticks stands where it was last, or was never seen.
        """
        places = np.full((tick - self.looked_tick, len(self._names), 2), np.nan)
        for k, name in enumerate(self._names):
            if (way := self._ways.get(name)) is None:
                continue
            own = np.column_stack((way.x_m, way.y_m))
            fresh = tick_of(way) == tick and len(own) == len(places)
            places[:, k] = own if fresh else own[-1:]
        self.looked_tick = tick
        return tuple(self._names[k] for k in sorted(self.contacts.look(places)))


def tick_of(way: TrueWay) -> int:
    """The last tick of it."""
    stamp = way.header.stamp
    return 100 * stamp.sec + stamp.nanosec // 10_000_000
