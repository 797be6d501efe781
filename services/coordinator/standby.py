"""Standby coordinator: waits beside a team's coordinator until that has gone."""

from __future__ import annotations

from touchline.bus import Bus
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.spec import parse
from touchline.schemas.team import TeamScenario
from touchline.services.coordinator.take_over import remaining_task


class Standby:
    """Watch over a coordinator; call `turn` in a loop.

    Attributes:
        seen: Session of the coordinator; "" before there is one.
    """

    def __init__(self, bus: Bus, team: TeamScenario) -> None:
        """Watch the coordinator of a team.

        Args:
            bus: Bus of the team's namespace, joined as a standby.
            team: The team, until its coordinator says otherwise.
        """
        self._presence = bus.presence()
        self._inbox = bus.inbox([topics.TEAM_SETUP, topics.TEAM_CELLS], keep="latest")
        self._team, self._cells = team, m.TeamCells()
        self.seen = ""

    def turn(self) -> bool:
        """Return True once the coordinator has gone."""
        self._presence.poll()
        for _, message in self._inbox.messages():
            if isinstance(message, m.String):
                self._team = parse(TeamScenario, message.data, "setup of the team")
            elif isinstance(message, m.TeamCells):
                self._cells = message
        if there := self._presence.instances(topics.COORDINATOR):
            self.seen = min(there)
        return bool(self.seen) and not there

    @property
    def team(self) -> TeamScenario:
        """The team with what is left of its task."""
        return self._team.model_copy(update={"task": remaining_task(self._team.task, self._cells)})

    @property
    def doing(self) -> str:
        """State as text."""
        return f"stands by for session {self.seen}" if self.seen else "waits for a coordinator to stand by for"
