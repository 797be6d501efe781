"""The coordinator of a team on the bus: whereabouts in, guidance out, tasks and stops on request.

Emulated robots may be driven in lockstep: at every exchange each of them holds its sim time until it is answered, and
the coordinator waits until all have reported the same time. So the bytes are those of `fleet simulate`, whatever the
machine. A robot silent for a second of wall time is no longer waited for, and that is reported on `events`.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Mapping
from enum import Enum
from typing import Final

from pydantic import TypeAdapter, ValidationError

from touchline.bus import Bus, ServedCall
from touchline.coordination.body_contacts import body_radius_m
from touchline.coordination.coordination import Coordination, Reported, margin_of
from touchline.coordination.dispatch.dispatch_memory import DispatchMemory
from touchline.coordination.exchange import EXCHANGE_TICKS, Exchange
from touchline.coordination.free_area import FreeArea
from touchline.coordination.guidance_messages import header_at
from touchline.coordination.late_robots import LateRobots
from touchline.coordination.task_statistics import TaskStatistics
from touchline.coordination.team_status import team_messages
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.errors import SpecError, TouchlineError
from touchline.schemas.spec import problems_of
from touchline.schemas.team import TaskSpec, TeamScenario
from touchline.services.coordinator.contact_injector import ContactInjector
from touchline.services.coordinator.dispatch_desk import DispatchDesk
from touchline.services.coordinator.external_algorithm import ExternalDecider
from touchline.services.coordinator.group_call import GroupCall, reasons, start_guidance
from touchline.services.coordinator.joining_robots import JoiningRobots
from touchline.services.coordinator.recall import Recall
from touchline.services.coordinator.removals import Removals
from touchline.services.coordinator.robot_link import RobotLink
from touchline.services.coordinator.succession import Succession
from touchline.services.coordinator.take_over import TakeOver
from touchline.services.coordinator.team_memory import MemoryKeeper, TeamMemory
from touchline.services.coordinator.team_robots import SILENT_S, TeamRobots

_LOG: Final = logging.getLogger(__name__)
_FIRST_S: Final = 30.0
"""Wall-clock time without a first message after which lockstep does not wait for a robot."""


class _Phase(Enum):
    """State of the coordinator."""

    TAKING_OVER = "takes over"
    WAITING = "waits for a task"
    BEGINNING = "is being asked to begin"
    GUIDING = "is guided"
    ENDED = "has ended its task"


class TeamService:
    """The coordinator on the bus; call `turn` in a loop.

    Args:
        bus: Bus of the team's namespace.
        team: The team.
        lockstep: Whether sim time of the robots waits for the coordinator.
        alone: Whether the run ends with this process: what it sends arrives, or is of no use to anybody.
        former: Memory of another coordinator, which has guided the robots that are under way; None: there was none.
    """

    def __init__(
        self,
        bus: Bus,
        team: TeamScenario,
        area: FreeArea,
        *,
        lockstep: bool,
        alone: bool,
        former: TeamMemory | None = None,
    ) -> None:
        self._bus, self._team, self._lockstep = bus, team, lockstep
        self._area = area
        names = former.names if former else team.names
        robots = self._robots = TeamRobots(bus, team, names, lockstep=lockstep)
        self._coordination = Coordination(team, area, lambda radio: ExternalDecider(robots.buses, radio), certain=alone)
        self._coordination.expect(names)
        self._exchange = Exchange(team, self._coordination)
        self._presser = ContactInjector(robots.buses, body_radius_m(team.vehicle), area)
        self._step = self._exchange.step_ticks if lockstep else EXCHANGE_TICKS
        self._next_tick = self._step
        self._tasks, self._stops = bus.serve(topics.TEAM_TASK), bus.serve(topics.TEAM_STOP)
        self._cells, self._status = bus.publisher(topics.TEAM_CELLS), bus.publisher(topics.TEAM_STATUS)
        self._reports = bus.publisher(topics.TEAM_REPORT)
        self._setup = bus.publisher(topics.TEAM_SETUP)
        self._setup.send(m.String(data=team.model_dump_json()))
        self._task, self._problem, self._since, self._updates = "", "", "", 0
        self._statistics: TaskStatistics | None = None
        self._phase = _Phase.TAKING_OVER if former else _Phase.WAITING
        self._taking, self._former = self._takes_over() if former else None, former
        self._memory = None if alone else MemoryKeeper(bus, self._coordination)
        self._succession = Succession(bus, robots.buses)
        self._removals = Removals(bus, self._coordination, joining=not lockstep)
        self._desk = DispatchDesk(bus, self._coordination)
        self._beginning: GroupCall | None = None
        self._joining = JoiningRobots(bus, robots, self._coordination)
        self._late_robots = LateRobots(bus.publisher(topics.EVENTS).send, SILENT_S)
        self._call: ServedCall[m.TeamTaskRequest, m.TeamTaskResponse] | None = None

    def _takes_over(self) -> TakeOver | Recall:
        """Return what makes all robots obey this coordinator: those by cells forget theirs."""
        if self._team.by_plans:
            return TakeOver(self._robots.buses)
        return Recall(self._robots.buses, self._begin_anew)

    def _begin_anew(self, buses: Mapping[str, Bus]) -> GroupCall:
        """Have robots that nobody guides be guided in cells from now on."""
        for name in buses:
            self._robots.links[name].begin()
        return start_guidance(buses, self._lockstep_s, plans=False, margin_m=margin_of(self._team))

    @property
    def _lockstep_s(self) -> float:
        return self._step / 100.0 if self._lockstep else 0.0

    def _begin(self, call: ServedCall[m.TeamTaskRequest, m.TeamTaskResponse]) -> None:
        """Have all robots be guided from now on; the call is answered when all have answered."""
        self._beginning = self._robots.begin_guided(self._lockstep_s)
        self._call, self._phase = call, _Phase.BEGINNING

    def _look_at_beginning(self) -> None:
        """Begin, or wait for another task, once all robots have answered."""
        asked, call = self._beginning, self._call
        if asked is None or call is None or not asked.done:
            return
        self._beginning = self._call = None
        if asked.refused:
            self._phase = _Phase.WAITING
            self._robots.call_all(topics.ABORT)
            problem = f"not all robots are guided: {reasons(asked.refused)}"
            call.reply(m.TeamTaskResponse(success=False, message=problem))
            return
        self._phase, now_s = _Phase.GUIDING, time.monotonic()
        for name, link in self._robots.links.items():
            link.heard_at_s = now_s
            self._joining.joins(name)
        call.reply(m.TeamTaskResponse(success=True, message=f"the team's task is {self._task}"))

    def _look_at_taking_over(self, now_s: float) -> None:
        """Guide robots that another coordinator has guided, once all of them obey."""
        taking = self._taking
        if taking is None:
            return
        if not taking.turn():
            if taking.none_is_guided:
                self._taking, self._phase = None, _Phase.WAITING
            return
        self._taking, self._phase, self._task = None, _Phase.GUIDING, self._team.task.kind
        since = f" since epoch {taking.epoch}" if isinstance(taking, TakeOver) else ""
        self._since = f"session {self._bus.session_id}{since}, after another was lost"
        _LOG.info("coordinator: %s", self._since)
        self._statistics = TaskStatistics(self._coordination, self._task)
        for name, link in self._robots.links.items():
            link.heard_at_s = now_s
            self._joining.joins(name)
        tasks = self._former.tasks if self._former is not None else None
        if isinstance(taking, TakeOver):
            self._resume(taking, tasks)
        else:
            self._coordination.go_on(tasks)
            self._begin_soon(taking)

    def _begin_soon(self, recall: Recall) -> None:
        """Make the first cells as soon as all robots have reported that they have none: at the next exchange."""
        if not self._lockstep:  # else every exchange has an update
            self._next_tick = self._exchange.update_ticks
        for name, stamp_s in recall.stamps_s.items():
            link = self._robots.links[name]
            link.forget_until(stamp_s)  # what it has reported since is not repeated while it waits for an answer
            if self._lockstep:  # it may wait for one of the former coordinator
                link.send((), round(100 * stamp_s))

    def _resume(self, taking: TakeOver, tasks: DispatchMemory | None) -> None:
        """Go on with the plans that robots follow, and the tasks of another dispatcher, if there was one."""
        ticks = {name: round(100 * each.state.stamp_s) for name, each in taking.followed.items()}
        self._next_tick = (max(ticks.values()) // self._step + 1) * self._step
        updates = self._exchange.update_ticks
        first = -(-self._next_tick // updates) * updates
        self._coordination.resume(taking.followed, (first - updates) / 100.0, tasks)
        for name, link in self._robots.links.items():
            if link.tick <= ticks[name]:  # else it has reported since, and waits for an answer to that
                link.whereabouts = taking.followed[name].state
            link.send((), ticks[name])

    def turn(self) -> bool:
        """Serve waiting calls, and exchange messages if due; return False if there was nothing to do.

        Raises:
            Replaced: Another coordinator has taken over.
        """
        now_s = time.monotonic()
        for link in self._robots.links.values():
            link.listen(now_s)
        self._serve()
        self._look_at_beginning()
        self._look_at_taking_over(now_s)
        if self._phase is not _Phase.GUIDING:
            return False
        self._succession.look(now_s)
        if self._lockstep:
            return self._in_step(now_s)
        self._joining.look(now_s)
        return self._as_it_comes()

    def _in_step(self, now_s: float) -> bool:
        if self._coordination.hub is None:  # a robot that began long before the others is ahead of them
            ahead = max((link.tick for link in self._robots.links.values()), default=0)
            self._next_tick = max(self._next_tick, -(-ahead // self._step) * self._step)
        tick, links = self._next_tick, self._robots.links
        for name, link in links.items():
            if link.fresh and -1 < link.tick < tick and link.tick % self._step == 0:
                self._catch_up(name, link)  # it hung, and its time is not that of the others any more
            elif not link.has_reported(tick) and _given_up(link, now_s):
                link.call(tick - self._step, now_s)
        silent = [link for link in links.values() if not link.has_reported(tick)]
        if any(not _given_up(link, now_s) for link in silent) or len(silent) == len(links):
            return False  # without any robot no sim time passes
        self._late_robots.look(tick, links)
        self._presser.press(tick, links)
        there = {name: link for name, link in links.items() if link.tick == tick and link.fresh}
        guidance = self._exchanged(tick, _whereabouts(there))
        for name, link in links.items() if self._phase is _Phase.GUIDING else ():
            if name in there:
                link.fresh = False
            if name in there or link.tick > tick:  # who is ahead is to wait for the others
                link.send(guidance.get(name, ()) if name in there else (), tick)
        self._next_tick += self._step
        return True

    def _catch_up(self, name: str, link: RobotLink) -> None:
        """Answer one robot alone."""
        if link.whereabouts is not None:
            self._coordination.hear(name, link.whereabouts, self._next_tick / 100.0)
        guidance = self._coordination.guidance().get(name)
        link.send([guidance] if guidance is not None else (), link.tick)
        link.fresh = False

    def _as_it_comes(self) -> bool:
        """Exchange messages every tenth of a second of the newest clock among the robots'."""
        links, offsets = self._robots.links, self._robots.offsets
        for name, link in links.items():
            if name not in offsets and link.whereabouts is not None:
                offsets[name] = self._next_tick - self._step - link.tick
        clocks = [link.tick + offsets[name] for name, link in links.items() if name in offsets]
        if max(clocks, default=-1) < self._next_tick:
            return False
        tick = max(clocks) // self._step * self._step
        fresh = {name: link for name, link in links.items() if link.fresh}
        guidance = self._exchanged(tick, _whereabouts(fresh))
        for name, messages in guidance.items():
            if name in links:  # else it has been removed since that was sent
                links[name].send(messages, links[name].tick)
        for link in fresh.values():
            link.fresh = False
        self._next_tick = tick + self._step
        return True

    def _exchanged(self, tick: int, whereabouts: dict[str, Reported]) -> dict[str, list[m.Guidance]]:
        """Exchange messages; if two robots are about to run into each other, pause all."""
        for name, link in self._robots.links.items():
            if math.isfinite(link.charge):
                self._coordination.hear_charge(name, link.charge)
        try:
            guidance = self._exchange.at(tick, whereabouts)
        except TouchlineError as error:
            if str(error) != self._problem:
                self._problem = str(error)
                self._stop_all()
            guidance = {}
        else:
            if self._exchange.updated:
                self._problem = ""
        if self._statistics is not None:
            self._statistics.count(len(whereabouts), sum(map(len, guidance.values())))
        if self._exchange.updated:
            self._publish(tick)
            self._look_for_end(tick)
            if self._lockstep and self._coordination.finished(tick / 100.0):
                self._phase = _Phase.ENDED
                self._robots.call_all(topics.ABORT)
        return guidance

    def _publish(self, tick: int) -> None:
        self._updates += 1
        known: dict[str, str | int] = {"task": self._task, "updates": self._updates, "robots": len(self._robots.links)}
        if self._problem:
            known |= {"problem": self._problem}
        if self._since:
            known |= {"coordinator": self._since}
        cells, status = team_messages(self._coordination, self._area, tick, known)
        self._cells.send(cells)
        self._status.send(status)
        self._keep_memory()  # before anybody is told
        self._desk.publish(ended=self._lockstep and self._coordination.finished(tick / 100.0))

    def _keep_memory(self) -> None:
        """Keep what another coordinator needs, if one can follow."""
        if self._memory is not None:
            self._memory.keep(self._team)

    def _look_for_end(self, tick: int) -> None:
        """Count the update, and report once the task has come to its end."""
        if self._statistics is None:
            return
        self._statistics.update(tick / 100.0)
        coordination = self._coordination
        ended = coordination.finished(tick / 100.0) if self._lockstep else coordination.all_arrived
        if ended and (report := self._statistics.report(finished=True)) is not None:
            self._send_report(report)
            self._statistics = None

    def _send_report(self, report: m.TeamReport) -> None:
        self._reports.send(report.model_copy(update={"header": header_at(self._next_tick)}))

    def _serve(self) -> None:
        if (task := self._tasks.poll()) is not None:
            self._take_task(task)
        self._desk.turn(self._keep_memory, ended=self._phase is _Phase.ENDED)
        if gone := self._removals.turn(self._robots.buses):
            self._robots.remove(gone)
        if (stop := self._stops.poll()) is not None:
            refused = self._stop_all()
            stop.reply(m.CommandResponse(success=not refused, message=reasons(refused) or "all robots are paused"))

    def _take_task(self, call: ServedCall[m.TeamTaskRequest, m.TeamTaskResponse]) -> None:
        """Start the team with the first task; later tasks replace it."""
        try:
            spec = parse_task(call.request.task_json)
            if self._phase is _Phase.GUIDING:
                self._replace_task(spec)
            elif self._phase is not _Phase.WAITING:
                raise SpecError("team", "task", f"comes while the team {self._phase.value}", "send it later, or anew")
        except SpecError as error:
            call.reply(m.TeamTaskResponse(success=False, message=str(error)))
            return
        self._task = spec.kind
        if spec != self._team.task:
            self._team = self._team.model_copy(update={"task": spec})
            self._setup.send(m.String(data=self._team.model_dump_json()))
        if self._phase is _Phase.WAITING:
            self._coordination.set_first_task(spec)
            self._statistics = TaskStatistics(self._coordination, spec.kind)
            self._begin(call)
            return
        call.reply(m.TeamTaskResponse(success=True, message=f"the team's task is {spec.kind}"))

    def _replace_task(self, spec: TaskSpec) -> None:
        """Continue with another task, and report on the one before.

        Raises:
            SpecError: The task is not possible.
        """
        ended = self._statistics.report(finished=False) if self._statistics is not None else None
        self._coordination.set_task(spec)
        if ended is not None:
            self._send_report(ended)
        self._statistics = TaskStatistics(self._coordination, spec.kind)

    def _stop_all(self) -> dict[str, str]:
        """Pause every robot; return those that are not paused by that, with the reasons."""
        return self._robots.call_all(topics.PAUSE)

    @property
    def former_is_back(self) -> bool:
        """Return whether the coordinator that is to be replaced guides robots after all."""
        return self._taking is not None and self._taking.former_is_back

    @property
    def figures(self) -> dict[str, object]:
        """Return figures for the diagnostics."""
        late = {"not_waited_for": ", ".join(sorted(self._late_robots.exchanges))} if self._late_robots.exchanges else {}
        return {
            "robots": len(self._robots.links),
            "updates": self._updates,
            "sim_time_s": self._next_tick / 100.0,
            **late,
        }

    @property
    def doing(self) -> str:
        """Return the state as text."""
        if self._taking is not None and self._taking.waits_for:
            name, reason = next(iter(self._taking.waits_for.items()))
            return f"{self._phase.value}; waits for {len(self._taking.waits_for)} robots, such as {name}: {reason}"
        if self._phase is not _Phase.GUIDING:
            return str(self._phase.value)
        waits = self._coordination.waits_for
        task = f"{self._task}; {self._since}" if self._since else self._task
        return self._problem or (f"waits for {', '.join(waits[:5])}" if waits else task)


def _whereabouts(links: Mapping[str, RobotLink]) -> dict[str, Reported]:
    return {name: link.whereabouts for name, link in links.items() if link.whereabouts is not None}


def _given_up(link: RobotLink, now_s: float) -> bool:
    return now_s - link.heard_at_s > (SILENT_S if link.whereabouts is not None else _FIRST_S)


def parse_task(text: str) -> TaskSpec:
    """Parse a task in JSON.

    Raises:
        SpecError: It is invalid.
    """
    try:
        spec: TaskSpec = TypeAdapter(TaskSpec).validate_json(text)
    except ValidationError as error:
        raise problems_of(error, "task", {}) from error
    return spec
