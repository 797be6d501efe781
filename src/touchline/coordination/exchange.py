"""Exchange of messages between a team and its coordinator, by radio, at a fixed period of sim time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from touchline.coordination.coordination import Coordination, Reported
from touchline.coordination.radio import Radio
from touchline.schemas.messages import Guidance
from touchline.schemas.team import TeamScenario

EXCHANGE_TICKS: Final = 10
"""Ticks between two exchanges over lossy links; updates are due at some of them."""
_TO_HUB, _TO_ROBOTS = 0, 1


class Exchange:
    """Exchange between a team and its coordinator.

    Args:
        team: Its links, and its update period.
        coordination: Its coordinator.

    Attributes:
        update_ticks: Ticks between updates.
        updated: Whether the last exchange included an update.
    """

    def __init__(self, team: TeamScenario, coordination: Coordination) -> None:
        self._coordination, self._lossless = coordination, team.links.lossless
        self._to_hub: Radio[Reported] = Radio(team.links, team.world.seed, _TO_HUB)
        self._to_robots: Radio[Guidance] = Radio(team.links, team.world.seed, _TO_ROBOTS)
        self.update_ticks = round(100 * team.update_s)
        self.updated = False

    @property
    def step_ticks(self) -> int:
        """Ticks from one exchange to the next."""
        return self.update_ticks if self._lossless else EXCHANGE_TICKS

    def at(self, tick: int, reported: Mapping[str, Reported]) -> dict[str, list[Guidance]]:
        """Pass messages to the coordinator, update if due, and return its messages.

        Args:
            tick: Sim time.
            reported: Message of each robot now; silent ones are left out.

        Returns:
            Guidance of each robot now, in order; robots without any are left out.

        Raises:
            TouchlineError: A robot has not kept to its cell or plan.
        """
        coordination, now_s = self._coordination, tick / 100.0
        for name in sorted(reported):
            self._to_hub.send(tick, name, reported[name])
        for name, message in self._to_hub.arrived(tick):
            coordination.hear(name, message, now_s)
        self.updated = tick % self.update_ticks == 0
        if self.updated:
            coordination.update(now_s)
        for name, guidance in coordination.guidance().items():
            self._to_robots.send(tick, name, guidance)
        found: dict[str, list[Guidance]] = {}
        for name, guidance in self._to_robots.arrived(tick):
            found.setdefault(name, []).append(guidance)
        return found
