"""A team guided by cells: its coordinator, and the radio between that and the robots."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from touchline.schemas.messages import Guidance, Whereabouts
from touchline.schemas.team import TeamScenario
from touchline.services.fleet.free_area import FreeArea
from touchline.services.fleet.hub import Hub, TeamSettings
from touchline.services.fleet.tasks import TeamTask
from touchline.services.runs.team.radio import Radio
from touchline.services.runs.team.team_guide import BelievedApart
from touchline.services.runs.team.team_robot import TeamRobot

SAYING_TICKS: Final = 10
"""Between two messages of a robot, where messages may be lost or late."""
_TO_HUB, _TO_ROBOTS = 0, 1


class CellGuide:
    """See `TeamGuide`."""

    def __init__(self, team: TeamScenario, area: FreeArea, robots: Mapping[str, TeamRobot]) -> None:
        """All robots are to be guided from now on.

        Raises:
            CommandRefused: Such a robot cannot be guided.
        """
        self._team, self._area, self._robots = team, area, robots
        seed, links = team.world.seed, team.links
        self._to_hub: Radio[Whereabouts] = Radio(links, seed, _TO_HUB)
        self._to_robots: Radio[Guidance] = Radio(links, seed, _TO_ROBOTS)
        self._hub: Hub | None = None
        self.believed = BelievedApart()
        for robot in robots.values():
            robot.emulator.begin_guided()

    @property
    def step_ticks(self) -> int:
        """See `TeamGuide`."""
        return round(100 * self._team.update_s) if self._team.links.lossless else SAYING_TICKS

    def places(self) -> dict[str, tuple[float, float]]:
        """See `TeamGuide`."""
        return {name: (said.x_m, said.y_m) for name, said in self._said().items()}

    def _said(self) -> dict[str, Whereabouts]:
        said = {name: robot.emulator.onboard.whereabouts for name, robot in self._robots.items()}
        return {name: each for name, each in said.items() if each is not None}

    def begin(self, task: TeamTask, tick: int) -> None:
        """See `TeamGuide`."""
        team, drive = self._team, self._team.vehicle.drive
        settings = TeamSettings(
            team.radius_m, drive.max_acceleration_mps2, drive.transit_speed_mps, team.onboard.team.lease_s
        )
        self._hub = Hub(self._area, task, self._said(), tick / 100.0, settings)

    def talk(self, tick: int, *, update: bool) -> None:
        """See `TeamGuide`."""
        assert self._hub is not None, "it has begun"
        hub, now_s = self._hub, tick / 100.0
        for name, said in self._said().items():
            self._to_hub.send(tick, name, said)
        for name, said in self._to_hub.arrived(tick):
            hub.receive(name, said, now_s)
        if update:
            hub.update(now_s)
            believed = self.believed
            believed.nearest_segments_m = min(believed.nearest_segments_m, hub.nearest_segments_m)
            believed.outside_cell_m = max(believed.outside_cell_m, *hub.strays_m.values())
        for name, told in hub.say().items():
            self._to_robots.send(tick, name, told)
        for name, told in self._to_robots.arrived(tick):
            self._robots[name].emulator.onboard.take_guidance(told)
