"""Standby coordinator: waits beside a team's coordinator until that has gone."""

from __future__ import annotations

from touchline.bus import Bus
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.spec import parse
from touchline.services.coordinator.take_over import TakeOver
from touchline.services.coordinator.team_memory import TeamMemory


class Standby:
    """Watch over a coordinator; call `turn` in a loop.

    Attributes:
        seen: Session of the coordinator; "" before there is one.
        memory: What the coordinator has published last.
    """

    def __init__(self, bus: Bus, memory: TeamMemory) -> None:
        """Watch the coordinator of a team.

        Args:
            bus: Bus of the team's namespace, joined as a standby.
            memory: Memory of the last coordinator, until there is another one.
        """
        self._presence = bus.presence()
        self._inbox = bus.inbox([topics.TEAM_MEMORY], keep="latest")
        buses = {name: bus.of(name) for name in memory.names}
        self._robots = TakeOver(buses, by_plans=memory.team.by_plans)
        self.memory = memory
        self.seen = ""

    def turn(self) -> bool:
        """Return True once the coordinator has gone, or all robots say that theirs had gone before."""
        self._presence.poll()
        for _, message in self._inbox.messages():
            if isinstance(message, m.String):
                self.memory = parse(TeamMemory, message.data, "memory of the coordinator")
        if there := self._presence.instances(topics.COORDINATOR):
            self.seen = min(there)
        return not there and (bool(self.seen) or (self._robots.look() and not self._robots.none_is_guided))

    @property
    def doing(self) -> str:
        """State as text."""
        return f"stands by for session {self.seen}" if self.seen else "waits for a coordinator to stand by for"
