"""Guidance of a team by cells or plans: its coordinator, and the radio to the robots."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from contextlib import suppress

from touchline.coordination.cells import SegmentsMeet
from touchline.coordination.coordination import Coordination, margin_of
from touchline.coordination.dispatch.queue_messages import QueueTeller
from touchline.coordination.exchange import Exchange
from touchline.coordination.free_area import FreeArea
from touchline.coordination.guidance_messages import header_at, stamped_guidance
from touchline.coordination.interventions import Interventions
from touchline.coordination.plans.plan_hub import OffPlan
from touchline.coordination.task_statistics import TaskStatistics
from touchline.coordination.tasks import TeamTask
from touchline.coordination.team_status import team_messages
from touchline.jobs.team.team_guide import BelievedApart
from touchline.jobs.team.team_robot import TeamRobot
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import Guidance
from touchline.schemas.team import TeamScenario
from touchline.services.robot_sim.packing import Payload

TeamListener = Callable[[str, list[Payload]], None]
"""Called with the sender, a robot or the team's namespace for the coordinator, and its messages."""


class HubGuide:
    """Guide of a team by its coordinator."""

    def __init__(
        self, team: TeamScenario, area: FreeArea, robots: Mapping[str, TeamRobot], listener: TeamListener | None = None
    ) -> None:
        """Start to guide all robots.

        Args:
            team: The team.
            area: The area.
            robots: By name.
            listener: Called with all messages, of robots and of the team.

        Raises:
            CommandRefused: A robot of this kind cannot be guided.
        """
        self._robots = robots
        self._coordination = Coordination(team, area)
        self._exchange = Exchange(team, self._coordination)
        self.believed, self.problem = BelievedApart(), ""
        self._team, self._area, self._listener = team, area, listener
        self._statistics, self._updates, self._ended = TaskStatistics(self._coordination, team.task.kind), 0, False
        self._teller = QueueTeller()
        for robot in robots.values():
            robot.begin_guided(plans=team.by_plans, margin_m=margin_of(team))

    @property
    def step_ticks(self) -> int:
        """Ticks until the next exchange, as of `TeamGuide`."""
        return self._exchange.step_ticks

    @property
    def task(self) -> TeamTask | None:
        """The team's task, as of `TeamGuide`."""
        return self._coordination.task

    @property
    def waits_for(self) -> tuple[str, ...]:
        """Return robots that are not localized, as of `TeamGuide`."""
        return self._coordination.waits_for

    @property
    def interventions(self) -> Interventions:
        """Changes of wishes so far, as of `TeamGuide`."""
        hub = self._coordination.hub
        return Interventions() if hub is None else hub.interventions

    def talk(self, tick: int, awake: Collection[str]) -> bool:
        """Exchange messages with the robots, as of `TeamGuide`."""
        robots = {name: robot for name, robot in self._robots.items() if name in awake}
        onboard = {name: each.emulator.onboard for name, each in robots.items()}
        whereabouts = {
            name: each.plan_state if self._team.by_plans else each.whereabouts for name, each in onboard.items()
        }
        for name in awake if self._team.task.kind == "dispatch" else ():
            self._coordination.hear_charge(name, self._robots[name].charge)
        try:
            guidance = self._exchange.at(tick, {name: each for name, each in whereabouts.items() if each is not None})
        except (SegmentsMeet, OffPlan) as error:
            guidance = {}
            self._pause_all(str(error))
        hearing = {} if self.finished(tick) else robots  # they are to brake then, as over the bus
        for name, messages in guidance.items():
            for message in stamped_guidance(messages, tick) if name in hearing else ():
                hearing[name].take_guidance(message)
        self._statistics.count(len(whereabouts), sum(map(len, guidance.values())))
        self._publish(tick, guidance, awake)
        hub = self._coordination.hub
        if hub is None or not self._exchange.updated:
            return False
        believed = self.believed
        believed.nearest_m = min(believed.nearest_m, hub.nearest_m)
        believed.outside_m = max(believed.outside_m, *hub.outside_m.values())
        return True

    def _publish(self, tick: int, guidance: Mapping[str, list[Guidance]], awake: Collection[str]) -> None:
        """Publish the coordinator's messages as over the bus."""
        updated, now_s = self._exchange.updated, tick / 100.0
        self._updates += updated
        if updated:
            self._statistics.update(now_s)
        if (hear := self._listener) is None:
            return
        finished = self._coordination.finished(now_s)
        for name in () if finished else sorted(awake):
            hear(name, [(topics.GUIDANCE, encode(each)) for each in stamped_guidance(guidance.get(name, ()), tick)])
        if not updated:
            return
        known: dict[str, str | int] = {
            "task": self._team.task.kind,
            "updates": self._updates,
            "robots": len(self._robots),
        }
        known |= {"problem": self.problem} if self.problem else {}
        cells, status = team_messages(self._coordination, self._area, tick, known)
        news: list[Payload] = [(topics.TEAM_CELLS, encode(cells)), (topics.TEAM_STATUS, encode(status))]
        if (queue := self._teller.news(self._coordination.dispatcher, ended=finished)) is not None:
            news.append((topics.TEAM_QUEUE, encode(queue)))
        if finished and not self._ended:
            self._ended = True
            if (report := self._statistics.report(finished=True)) is not None:
                news.append((topics.TEAM_REPORT, encode(report.model_copy(update={"header": header_at(tick)}))))
        hear(topics.TEAM_NAMESPACE, news)

    def _pause_all(self, problem: str) -> None:
        """Pause all robots, as the coordinator does over the bus when a robot is where it may not be."""
        self.problem = problem
        for robot in self._robots.values():
            with suppress(CommandRefused):
                robot.emulator.pause()

    def finished(self, tick: int) -> bool:
        """Return whether the run is over, as of `TeamGuide`."""
        return self._coordination.finished(tick / 100.0)

    def blockage(self, name: str) -> str:
        """Return why a robot does not arrive, as of `TeamGuide`."""
        return self._statistics.blockage(name)
