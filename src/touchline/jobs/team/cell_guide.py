"""A team guided by cells: its coordinator, and the radio between that and the robots."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from contextlib import suppress

from touchline.fleet.answers import answers, header_at
from touchline.fleet.cells import SegmentsMeet
from touchline.fleet.coordination import Coordination
from touchline.fleet.exchange import Exchange
from touchline.fleet.free_area import FreeArea
from touchline.fleet.task_books import TaskBooks
from touchline.fleet.tasks import TeamTask
from touchline.fleet.team_status import team_news
from touchline.jobs.team.team_guide import BelievedApart
from touchline.jobs.team.team_robot import TeamRobot
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import Guidance
from touchline.schemas.team import TeamScenario
from touchline.services.robot_sim.packing import Payload

TeamListener = Callable[[str, list[Payload]], None]
"""Told who says what: a robot, or under the team's own name its coordinator."""


class CellGuide:
    """See `TeamGuide`."""

    def __init__(
        self, team: TeamScenario, area: FreeArea, robots: Mapping[str, TeamRobot], listener: TeamListener | None = None
    ) -> None:
        """All robots are to be guided from now on.

        Args:
            team: What they do.
            area: Where.
            robots: By name.
            listener: Told what is told to whom, and of the team, if anybody listens.

        Raises:
            CommandRefused: Such a robot cannot be guided.
        """
        self._robots = robots
        self._coordination = Coordination(team, area)
        self._exchange = Exchange(team, self._coordination)
        self.believed, self.problem = BelievedApart(), ""
        self._area, self._kind, self._listener = area, team.task.kind, listener
        self._books, self._updates, self._ended = TaskBooks(self._coordination, self._kind), 0, False
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
        robots = {name: robot for name, robot in self._robots.items() if name in awake}
        said = {name: each.emulator.onboard.whereabouts for name, each in robots.items()}
        try:
            told = self._exchange.at(tick, {name: each for name, each in said.items() if each is not None})
        except SegmentsMeet as error:
            told = {}
            self._pause_all(str(error))
        hearing = {} if self.finished(tick) else robots  # they are to brake then, as over the bus
        for name, messages in told.items():
            for message in answers(messages, tick) if name in hearing else ():
                hearing[name].take_guidance(message)
        self._books.count(len(said), sum(map(len, told.values())))
        self._tell(tick, told, awake)
        hub = self._coordination.hub
        if hub is None or not self._exchange.updated:
            return False
        believed = self.believed
        believed.nearest_segments_m = min(believed.nearest_segments_m, hub.nearest_segments_m)
        believed.outside_cell_m = max(believed.outside_cell_m, *hub.strays_m.values())
        return True

    def _tell(self, tick: int, told: Mapping[str, list[Guidance]], awake: Collection[str]) -> None:
        """Keep the books, and let who listens hear what the coordinator tells over the bus."""
        updated, now_s = self._exchange.updated, tick / 100.0
        self._updates += updated
        if updated:
            self._books.update(now_s)
        if (hear := self._listener) is None:
            return
        finished = self._coordination.finished(now_s)
        for name in () if finished else sorted(awake):
            hear(name, [(topics.GUIDANCE, encode(each)) for each in answers(told.get(name, ()), tick)])
        if not updated:
            return
        known: dict[str, str | int] = {"task": self._kind, "updates": self._updates, "robots": len(self._robots)}
        known |= {"problem": self.problem} if self.problem else {}
        cells, status = team_news(self._coordination, self._area, tick, known)
        news: list[Payload] = [(topics.TEAM_CELLS, encode(cells)), (topics.TEAM_STATUS, encode(status))]
        if finished and not self._ended:
            self._ended = True
            if (report := self._books.report(finished=True)) is not None:
                news.append((topics.TEAM_REPORT, encode(report.model_copy(update={"header": header_at(tick)}))))
        hear(topics.TEAM_NAMESPACE, news)

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
        return self._books.hindrance(name)
