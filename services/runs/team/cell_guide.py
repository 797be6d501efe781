"""A team guided by cells: its coordinator, and the radio between that and the robots."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from contextlib import suppress

from touchline.schemas.errors import CommandRefused
from touchline.schemas.team import TeamScenario
from touchline.services.fleet.cells import SegmentsMeet
from touchline.services.fleet.coordination import Coordination
from touchline.services.fleet.exchange import Exchange
from touchline.services.fleet.free_area import FreeArea
from touchline.services.fleet.hindrances import Hindrances
from touchline.services.fleet.tasks import TeamTask
from touchline.services.runs.team.team_guide import BelievedApart
from touchline.services.runs.team.team_robot import TeamRobot


class CellGuide:
    """See `TeamGuide`."""

    def __init__(self, team: TeamScenario, area: FreeArea, robots: Mapping[str, TeamRobot]) -> None:
        """All robots are to be guided from now on.

        Raises:
            CommandRefused: Such a robot cannot be guided.
        """
        self._robots = robots
        self._coordination = Coordination(team, area)
        self._exchange = Exchange(team, self._coordination)
        self.believed, self.problem = BelievedApart(), ""
        self._hindrances = Hindrances(self._coordination)
        for robot in robots.values():
            robot.begin_guided()

    @property
    def step_ticks(self) -> int:
        """See `TeamGuide`."""
        return self._exchange.step_ticks

    @property
    def task(self) -> TeamTask | None:
        """See `TeamGuide`."""
        return self._coordination.task

    @property
    def waits_for(self) -> tuple[str, ...]:
        """See `TeamGuide`."""
        return self._coordination.waits_for

    def talk(self, tick: int, awake: Collection[str]) -> bool:
        """See `TeamGuide`."""
        onboard = {name: robot.emulator.onboard for name, robot in self._robots.items() if name in awake}
        said = {name: each.whereabouts for name, each in onboard.items()}
        try:
            told = self._exchange.at(tick, {name: each for name, each in said.items() if each is not None})
        except SegmentsMeet as error:
            told = {}
            self._pause_all(str(error))
        for name, messages in told.items():
            for message in messages if name in onboard else ():
                onboard[name].take_guidance(message)
        hub = self._coordination.hub
        if hub is None or not self._exchange.updated:
            return False
        self._hindrances.update(tick / 100.0)
        believed = self.believed
        believed.nearest_segments_m = min(believed.nearest_segments_m, hub.nearest_segments_m)
        believed.outside_cell_m = max(believed.outside_cell_m, *hub.strays_m.values())
        return True

    def _pause_all(self, problem: str) -> None:
        """As the coordinator does over the bus when a robot is where it may not be."""
        self.problem = problem
        for robot in self._robots.values():
            with suppress(CommandRefused):
                robot.emulator.pause()

    def finished(self, tick: int) -> bool:
        """See `TeamGuide`."""
        return self._coordination.finished(tick / 100.0)

    def hindrance(self, name: str) -> str:
        """See `TeamGuide`."""
        return self._hindrances.of(name)
