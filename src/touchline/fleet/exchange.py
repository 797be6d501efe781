"""One exchange of messages between a team and its coordinator, by radio, every so many ticks of sim time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from touchline.fleet.coordination import Coordination
from touchline.fleet.radio import Radio
from touchline.schemas.messages import Guidance, Whereabouts
from touchline.schemas.team import TeamScenario

SAYING_TICKS: Final = 10
"""Between two exchanges where messages may be lost or late; updates are due at some of them."""
_TO_HUB, _TO_ROBOTS = 0, 1


class Exchange:
    """See the module.

    Args:
        team: Its links, and how often it is updated.
        coordination: Its coordinator.

    Attributes:
        update_ticks: From update to update.
        updated: Whether there was an update with the last exchange.
    """

    def __init__(self, team: TeamScenario, coordination: Coordination) -> None:
        self._coordination, self._lossless = coordination, team.links.lossless
        self._to_hub: Radio[Whereabouts] = Radio(team.links, team.world.seed, _TO_HUB)
        self._to_robots: Radio[Guidance] = Radio(team.links, team.world.seed, _TO_ROBOTS)
        self.update_ticks = round(100 * team.update_s)
        self.updated = False

    @property
    def step_ticks(self) -> int:
        """From exchange to exchange."""
        return self.update_ticks if self._lossless else SAYING_TICKS

    def at(self, tick: int, said: Mapping[str, Whereabouts]) -> dict[str, list[Guidance]]:
        """Messages there, an update if it is due, and messages back.

        Args:
            tick: Of sim time.
            said: By each robot now; who says nothing is left out.

        Returns:
            What each robot is told now, in order; who is told nothing is left out.

        Raises:
            SegmentsMeet: A robot has not kept to its cell.
        """
        coordination, now_s = self._coordination, tick / 100.0
        for name in sorted(said):
            self._to_hub.send(tick, name, said[name])
        for name, message in self._to_hub.arrived(tick):
            coordination.hear(name, message, now_s)
        self.updated = tick % self.update_ticks == 0
        if self.updated:
            coordination.update(now_s)
        for name, told in coordination.say().items():
            self._to_robots.send(tick, name, told)
        found: dict[str, list[Guidance]] = {}
        for name, told in self._to_robots.arrived(tick):
            found.setdefault(name, []).append(told)
        return found
