"""Robots that come to the bus, or come back: invited to join a team that is not in lockstep, and taken in."""

from __future__ import annotations

import logging
import math
from typing import Final

from touchline.bus import Bus
from touchline.coordination.coordination import Coordination
from touchline.schemas import topics
from touchline.services.coordinator.group_call import GroupCall
from touchline.services.coordinator.invitations import Invitations
from touchline.services.coordinator.team_robots import SILENT_S, TeamRobots

_LOG: Final = logging.getLogger(__name__)
_LOOK_S: Final = 1.0
"""Wall-clock time between two looks for newcomers."""


class JoiningRobots:
    """Robots that may join; call `look` in a loop.

    Args:
        bus: Bus of the team's namespace.
        robots: Robots of the team.
        coordination: The team's coordinator.
    """

    def __init__(self, bus: Bus, robots: TeamRobots, coordination: Coordination) -> None:
        self._roster, self._robots, self._coordination = bus.roster(), robots, coordination
        self._invitations = Invitations()
        self._asked: dict[str, GroupCall] = {}
        self._look_at_s = 0.0

    def joins(self, name: str) -> None:
        """Note that a robot is guided: it is not invited again before it comes anew."""
        self._invitations.joins(name)

    def look(self, now_s: float) -> None:
        """Invite robots that have come to the bus, and take their answers."""
        self._roster.poll()
        if now_s >= self._look_at_s and math.isfinite(self._roster.counted_s):
            self._look_at_s = now_s + _LOOK_S
            there = set(self._roster.robots((topics.ROBOT_SIM,))) - self._coordination.out
            for name in self._invitations.due(sorted(there), now_s):
                self._invite(name, now_s)
        for name in [name for name, asked in self._asked.items() if asked.done]:
            refused = self._asked.pop(name).refused
            if not refused:
                self._invitations.joins(name)
                self._robots.take_in(name)
            elif self._invitations.refuses(name, refused[name], now_s):
                _LOG.warning("%s does not join yet: %s", name, refused[name])

    def _invite(self, name: str, now_s: float) -> None:
        """Invite a robot to join, unless it is guided: then it already reports where it is."""
        link = self._robots.links.get(name)
        if link is not None and link.whereabouts is not None and now_s - link.heard_at_s <= SILENT_S:
            self._invitations.joins(name)
        else:
            self._asked[name] = self._robots.invite(name)
