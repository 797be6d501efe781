"""Robots of a team on the bus: their buses and links, and what all of them are asked at once."""

from __future__ import annotations

import uuid
from collections.abc import Iterable
from typing import Final

from touchline.bus import Bus
from touchline.coordination.coordination import margin_of
from touchline.schemas import messages as m
from touchline.schemas.team import TeamScenario
from touchline.schemas.topics import Service
from touchline.services.coordinator.group_call import GroupCall, start_guidance
from touchline.services.coordinator.robot_link import RobotLink

SILENT_S: Final = 1.0
"""Wall-clock time of silence after which lockstep does not wait for a robot."""


class TeamRobots:
    """Robots of a team.

    Args:
        bus: Bus of the team's namespace.
        team: The team.
        names: Names of those that are in it at first.
        lockstep: Whether sim time of the robots waits for the coordinator.

    Attributes:
        buses: Their buses by name, and of all others that have been invited.
        links: Links to those that are in the team.
        offsets: Ticks from the clock of each to the coordinator's, once known.
    """

    def __init__(self, bus: Bus, team: TeamScenario, names: Iterable[str], *, lockstep: bool) -> None:
        self._bus, self._team, self._lockstep = bus, team, lockstep
        self.buses = {name: bus.of(name) for name in names}
        self.links = {name: RobotLink(each, team, lockstep=lockstep) for name, each in self.buses.items()}
        self.offsets: dict[str, int] = {}

    def call_all(self, service: Service[m.CommandRequest, m.CommandResponse]) -> dict[str, str]:
        """Give every robot the same command, and wait; return those that refuse or are silent, with the reasons."""
        return GroupCall(self._linked(), service, m.CommandRequest(request_id=uuid.uuid4().hex), SILENT_S).wait()

    def begin_guided(self, lockstep_s: float) -> GroupCall:
        """Ask every robot to be guided from now on.

        Args:
            lockstep_s: Sim time from one exchange of messages to the next in lockstep; otherwise 0.
        """
        return start_guidance(self._linked(), lockstep_s, plans=self._team.by_plans, margin_m=margin_of(self._team))

    def _linked(self) -> dict[str, Bus]:
        return {name: self.buses[name] for name in self.links}

    def invite(self, name: str) -> GroupCall:
        """Ask a robot that has come to the bus to be guided from now on."""
        if name not in self.buses:
            self.buses[name] = self._bus.of(name)
        joining, team = {name: self.buses[name]}, self._team
        return start_guidance(joining, 0.0, plans=team.by_plans, margin_m=margin_of(team))

    def take_in(self, name: str) -> None:
        """Guide a robot from now on; if it was guided before, its process was restarted, and so was its clock."""
        self.offsets.pop(name, None)
        if name not in self.links:
            self.links[name] = RobotLink(self.buses[name], self._team, lockstep=self._lockstep)
        self.links[name].begin()

    def remove(self, name: str) -> None:
        """Remove a robot from those that are guided; its bus stays."""
        del self.links[name]
        self.offsets.pop(name, None)
