"""The coordinator of a team as a process: whereabouts in, guidance out, tasks and stops on request.

Emulated robots may be driven in lockstep: at every exchange each of them holds its sim time until it is answered, and
the coordinator waits until all have told of the same time. So the bytes are those of `fleet simulate`, whatever the
machine. Who says nothing for a second of wall time is waited for no more, and that is told on `events`.
"""

from __future__ import annotations

import math
import sys
import time
import uuid
from enum import Enum
from functools import partial
from typing import Final

from pydantic import TypeAdapter, ValidationError

from touchline.bus import Bus, BusConfig, HealthReporter, ServedCall
from touchline.core.compilations import run_steps
from touchline.fleet.answers import header_at
from touchline.fleet.body_contacts import body_radius_m
from touchline.fleet.coordination import Coordination
from touchline.fleet.exchange import SAYING_TICKS, Exchange
from touchline.fleet.free_area import FreeArea
from touchline.fleet.laggards import Laggards
from touchline.fleet.starts import free_area
from touchline.fleet.task_books import TaskBooks
from touchline.fleet.team_status import team_news
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.errors import SpecError, TouchlineError
from touchline.schemas.spec import problems_of
from touchline.schemas.team import TaskSpec, TeamScenario
from touchline.schemas.topics import Service
from touchline.services.coordinator.asking import AskedRobots, ask_to_be_guided, reasons
from touchline.services.coordinator.contact_injector import BumperPresser
from touchline.services.coordinator.invitations import Invitations
from touchline.services.coordinator.removals import Removals
from touchline.services.coordinator.robot_line import RobotLine
from touchline.services.coordinator.warm_up_team import warm_up_team
from touchline.supervision.late_compilations import LateCompilations
from touchline.supervision.shutdown import until_stopped

IDLE_S: Final = 0.001
"""Wall time between two looks at the bus."""
SILENT_S: Final = 1.0
"""Wall time: in lockstep a robot that has said nothing for so long is not waited for."""
_FIRST_S: Final = 30.0
"""The same, before it has said anything."""
_LOOK_S: Final = 1.0
"""Wall time between two looks for robots that have come."""


class _Phase(Enum):
    """What the coordinator is doing."""

    WAITING = "waits for a task"
    BEGINNING = "is being asked to begin"
    GUIDING = "is guided"
    ENDED = "has ended its task"


class TeamService:
    """The coordinator on the bus; call `turn` in a loop.

    Args:
        bus: Of the team's namespace.
        team: What it does.
        lockstep: Whether sim time of the robots waits for the coordinator.
    """

    def __init__(self, bus: Bus, team: TeamScenario, area: FreeArea, *, lockstep: bool) -> None:
        self._bus, self._team, self._lockstep = bus, team, lockstep
        self._area = area
        self._coordination = Coordination(team, area)
        self._exchange = Exchange(team, self._coordination)
        self._buses = {name: bus.of(name) for name in team.names}  # and of all others that have been asked to join
        self._lines = {name: RobotLine(each, lockstep=lockstep) for name, each in self._buses.items()}
        self._presser = BumperPresser(self._buses, body_radius_m(team.vehicle), area)
        self._step = self._exchange.step_ticks if lockstep else SAYING_TICKS
        self._next_tick = self._step
        self._offsets: dict[str, int] = {}
        self._roster, self._look_at_s = bus.roster(), 0.0
        self._tasks, self._stops = bus.serve(topics.TEAM_TASK), bus.serve(topics.TEAM_STOP)
        self._cells, self._status = bus.publisher(topics.TEAM_CELLS), bus.publisher(topics.TEAM_STATUS)
        self._reports = bus.publisher(topics.TEAM_REPORT)
        self._setup = bus.publisher(topics.TEAM_SETUP)
        self._setup.send(m.String(data=team.model_dump_json()))
        self._task, self._problem, self._updates = "", "", 0
        self._books: TaskBooks | None = None
        self._phase = _Phase.WAITING
        self._removals = Removals(bus, self._coordination, joining=not lockstep)
        self._beginning: AskedRobots | None = None
        self._invitations = Invitations()
        self._laggards = Laggards(bus.publisher(topics.EVENTS).send, SILENT_S)
        self._asked: dict[str, AskedRobots] = {}
        self._call: ServedCall[m.TeamTaskRequest, m.TeamTaskResponse] | None = None

    def _begin(self, call: ServedCall[m.TeamTaskRequest, m.TeamTaskResponse]) -> None:
        """Have all robots be guided from now on; the call is answered when all have answered."""
        buses = {name: self._buses[name] for name in self._lines}
        self._beginning = ask_to_be_guided(buses, self._lockstep_s)
        self._call, self._phase = call, _Phase.BEGINNING

    @property
    def _lockstep_s(self) -> float:
        return self._step / 100.0 if self._lockstep else 0.0

    def _look_at_beginning(self) -> None:
        """Begin, or wait for another task, once all robots have answered."""
        asked, call = self._beginning, self._call
        if asked is None or call is None or not asked.done:
            return
        self._beginning = self._call = None
        if asked.refused:
            self._phase = _Phase.WAITING
            self._call_all(topics.ABORT)
            problem = f"not all robots are guided: {reasons(asked.refused)}"
            call.reply(m.TeamTaskResponse(success=False, message=problem))
            return
        self._phase, now_s = _Phase.GUIDING, time.monotonic()
        for name, line in self._lines.items():
            line.said_at_s = now_s
            self._invitations.joins(name)
        call.reply(m.TeamTaskResponse(success=True, message=f"the team's task is {self._task}"))

    def turn(self) -> bool:
        """Serve what waits, and exchange messages if that is due; False if there was nothing to do."""
        now_s = time.monotonic()
        for line in self._lines.values():
            line.listen(now_s)
        self._serve()
        self._look_at_beginning()
        if self._phase is not _Phase.GUIDING:
            return False
        if self._lockstep:
            return self._in_step(now_s)
        self._look_for_robots(now_s)
        return self._as_it_comes()

    def _in_step(self, now_s: float) -> bool:
        tick = self._next_tick
        for name, line in self._lines.items():
            if line.fresh and -1 < line.tick < tick and line.tick % self._step == 0:
                self._catch_up(name, line)  # it was frozen, and its time is not that of the others any more
        if any(not line.has_told(tick) and not _given_up(line, now_s) for line in self._lines.values()):
            return False
        self._laggards.look(tick, self._lines)
        self._presser.press(tick, self._lines)
        there = {name: line for name, line in self._lines.items() if line.tick >= tick and line.fresh}
        told = self._exchanged(tick, {name: line.said for name, line in there.items() if line.said is not None})
        for name, line in there.items():
            line.fresh = False
            if self._phase is _Phase.GUIDING:
                line.tell(told.get(name, ()), line.tick)
        self._next_tick += self._step
        return True

    def _catch_up(self, name: str, line: RobotLine) -> None:
        """Answer one robot alone."""
        if line.said is not None:
            self._coordination.hear(name, line.said, self._next_tick / 100.0)
        told = self._coordination.say().get(name)
        line.tell([told] if told is not None else (), line.tick)
        line.fresh = False

    def _as_it_comes(self) -> bool:
        """An exchange every tenth of a second of the newest clock among the robots'."""
        for name, line in self._lines.items():
            if name not in self._offsets and line.said is not None:
                self._offsets[name] = self._next_tick - self._step - line.tick
        clocks = [line.tick + self._offsets[name] for name, line in self._lines.items() if name in self._offsets]
        if max(clocks, default=-1) < self._next_tick:
            return False
        tick = max(clocks) // self._step * self._step
        fresh = {name: line for name, line in self._lines.items() if line.fresh}
        told = self._exchanged(tick, {name: line.said for name, line in fresh.items() if line.said is not None})
        for name, messages in told.items():
            if name in self._lines:  # else it has been taken out since that was sent
                self._lines[name].tell(messages, self._lines[name].tick)
        for line in fresh.values():
            line.fresh = False
        self._next_tick = tick + self._step
        return True

    def _exchanged(self, tick: int, said: dict[str, m.Whereabouts]) -> dict[str, list[m.Guidance]]:
        """Exchange messages; if two are about to run into each other all are paused."""
        try:
            told = self._exchange.at(tick, said)
        except TouchlineError as error:
            if str(error) != self._problem:
                self._problem = str(error)
                self._stop_all()
            told = {}
        else:
            if self._exchange.updated:
                self._problem = ""
        if self._books is not None:
            self._books.count(len(said), sum(map(len, told.values())))
        if self._exchange.updated:
            self._publish(tick)
            self._look_for_end(tick)
            if self._lockstep and self._coordination.finished(tick / 100.0):
                self._phase = _Phase.ENDED
                self._call_all(topics.ABORT)
        return told

    def _publish(self, tick: int) -> None:
        self._updates += 1
        known: dict[str, str | int] = {"task": self._task, "updates": self._updates, "robots": len(self._lines)}
        if self._problem:
            known |= {"problem": self._problem}
        cells, status = team_news(self._coordination, self._area, tick, known)
        self._cells.send(cells)
        self._status.send(status)

    def _look_for_end(self, tick: int) -> None:
        """Account for the update, and report once the task has come to its end."""
        if self._books is None:
            return
        self._books.update(tick / 100.0)
        coordination = self._coordination
        ended = coordination.finished(tick / 100.0) if self._lockstep else coordination.all_arrived
        if ended and (report := self._books.report(finished=True)) is not None:
            self._send_report(report)
            self._books = None

    def _send_report(self, report: m.TeamReport) -> None:
        self._reports.send(report.model_copy(update={"header": header_at(self._next_tick)}))

    def _serve(self) -> None:
        if (task := self._tasks.poll()) is not None:
            self._take_task(task)
        if gone := self._removals.turn(self._buses):
            del self._lines[gone]
            self._offsets.pop(gone, None)
        if (stop := self._stops.poll()) is not None:
            refused = self._stop_all()
            stop.reply(m.CommandResponse(success=not refused, message=reasons(refused) or "all robots are paused"))

    def _take_task(self, call: ServedCall[m.TeamTaskRequest, m.TeamTaskResponse]) -> None:
        """The first task sets the team in motion; later ones replace it."""
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
        if self._phase is _Phase.WAITING:
            self._coordination.set_first_task(spec)
            self._books = TaskBooks(self._coordination, spec.kind)
            self._begin(call)
            return
        call.reply(m.TeamTaskResponse(success=True, message=f"the team's task is {spec.kind}"))

    def _replace_task(self, spec: TaskSpec) -> None:
        """Go on with another task, and report what has become of the one before.

        Raises:
            SpecError: It cannot be had.
        """
        ended = self._books.report(finished=False) if self._books is not None else None
        self._coordination.set_task(spec)
        if ended is not None:
            self._send_report(ended)
        self._books = TaskBooks(self._coordination, spec.kind)

    def _stop_all(self) -> dict[str, str]:
        """Pause every robot; returns who is not paused by that, and why."""
        return self._call_all(topics.PAUSE)

    def _call_all(self, service: Service[m.CommandRequest, m.CommandResponse]) -> dict[str, str]:
        """Give every robot the same command, and wait; returns who refuses or is silent, and why."""
        buses = {name: self._buses[name] for name in self._lines}
        return AskedRobots(buses, service, m.CommandRequest(request_id=uuid.uuid4().hex), SILENT_S).wait()

    def _look_for_robots(self, now_s: float) -> None:
        """Ask robots that have come to the bus to join, and hear what they say to that."""
        self._roster.poll()
        if now_s >= self._look_at_s and math.isfinite(self._roster.counted_s):
            self._look_at_s = now_s + _LOOK_S
            there = set(self._roster.robots((topics.ROBOT_SIM,))) - self._coordination.out
            for name in self._invitations.due(sorted(there), now_s):
                self._invite(name, now_s)
        for name in [name for name, asked in self._asked.items() if asked.done]:
            refused = self._asked.pop(name).refused
            if not refused:
                self._take_in(name)
            elif self._invitations.refuses(name, refused[name], now_s):
                sys.stderr.write(f"warning: {name} does not join yet: {refused[name]}\n")

    def _invite(self, name: str, now_s: float) -> None:
        """Ask a robot to join, unless it is guided: then it tells where it is."""
        line = self._lines.get(name)
        if line is not None and line.said is not None and now_s - line.said_at_s <= SILENT_S:
            self._invitations.joins(name)
            return
        if name not in self._buses:
            self._buses[name] = self._bus.of(name)
        self._asked[name] = ask_to_be_guided({name: self._buses[name]}, self._lockstep_s)

    def _take_in(self, name: str) -> None:
        """It is guided from now on; if it was before, its process is another one, and so is its clock."""
        self._invitations.joins(name)
        self._offsets.pop(name, None)
        if name not in self._lines:
            self._lines[name] = RobotLine(self._buses[name], lockstep=self._lockstep)
        self._lines[name].said = None

    @property
    def figures(self) -> dict[str, object]:
        """For the diagnostics."""
        left = {"not_waited_for": ", ".join(sorted(self._laggards.exchanges))} if self._laggards.exchanges else {}
        return {"robots": len(self._lines), "updates": self._updates, "sim_time_s": self._next_tick / 100.0, **left}

    @property
    def doing(self) -> str:
        """In a word or a line."""
        if self._phase is not _Phase.GUIDING:
            return str(self._phase.value)
        waits = self._coordination.waits_for
        return self._problem or (f"waits for {', '.join(waits[:5])}" if waits else self._task)


def _given_up(line: RobotLine, now_s: float) -> bool:
    return now_s - line.said_at_s > (SILENT_S if line.said is not None else _FIRST_S)


def parse_task(text: str) -> TaskSpec:
    """A task in JSON.

    Raises:
        SpecError: It is none.
    """
    try:
        spec: TaskSpec = TypeAdapter(TaskSpec).validate_json(text)
    except ValidationError as error:
        raise problems_of(error, "task", {}) from error
    return spec


def run_service(
    team: TeamScenario, config: BusConfig | None = None, *, lockstep: bool = False, supervisor: int | None = None
) -> None:
    """Coordinate a team until SIGTERM or SIGINT (or until `supervisor`, the parent process, is gone).

    Args:
        team: What it is to do; its robots are on the bus, by their names.
        config: Where the bus is; its namespace is the team's.
        lockstep: Whether the emulated robots' sim time waits for the coordinator.
        supervisor: Process id of the parent, to end with it.

    Raises:
        SpecError: The bus configuration, or the area, cannot be used.
        TouchlineError: Another coordinator runs, or a robot cannot be guided.
    """
    config = config or BusConfig.from_environment((topics.TEAM_NAMESPACE,))
    area = free_area(team)
    with until_stopped(supervisor) as stop, Bus.open(topics.COORDINATOR, config, lambda: stop.asked) as bus:
        bus.claim()
        health = HealthReporter(bus)
        health.starting("loading kernels")
        run_steps([("a team of two", partial(warm_up_team, team, area))], health.starting)
        service = TeamService(bus, team, area, lockstep=lockstep)
        late = LateCompilations(stop)
        health.common = late.values
        late.watch()
        while not stop:
            if not service.turn():
                time.sleep(IDLE_S)
            health.poll(service.figures, message=service.doing)
