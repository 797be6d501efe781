"""The coordinator of a team as a process: whereabouts in, guidance out, tasks and stops on request.

Emulated robots may be driven in lockstep: at every exchange each of them holds its sim time until it is answered, and
the coordinator waits until all have told of the same time. So the bytes are those of `fleet simulate`, whatever the
machine. Who says nothing for a second of wall time is waited for no more.
"""

from __future__ import annotations

import sys
import time
import uuid
from collections.abc import Sequence
from enum import Enum
from typing import Final

from pydantic import TypeAdapter, ValidationError

from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.errors import SpecError, TouchlineError
from touchline.schemas.messages.team_messages import NOTHING_HEARD_S
from touchline.schemas.spec import first_problem
from touchline.schemas.team import TaskSpec, TeamScenario
from touchline.schemas.topics import Service
from touchline.services.bus import Bus, BusConfig, HealthReporter, ServedCall
from touchline.services.fleet.coordination import Coordination
from touchline.services.fleet.exchange import SAYING_TICKS, Exchange
from touchline.services.fleet.free_area import FreeArea
from touchline.services.fleet.muster import Muster
from touchline.services.fleet.starts import free_area
from touchline.services.fleet.team_status import team_status
from touchline.services.fleet.warm_up_team import warm_up_team
from touchline.services.system.shutdown import until_stopped

IDLE_S: Final = 0.001
"""Wall time between two looks at the bus."""
SILENT_S: Final = 1.0
"""Wall time: in lockstep a robot that has said nothing for so long is not waited for."""
_FIRST_S: Final = 30.0
"""The same, before it has said anything."""
_CALL_S: Final = 10.0
_LOOK_S: Final = 1.0
"""Wall time between two looks for robots that have come."""
_MAP: Final = "map"


class _Phase(Enum):
    """What the coordinator is doing."""

    WAITING = "waits for a task"
    BEGINNING = "is being asked to begin"
    GUIDING = "is guided"
    ENDED = "has ended its task"


class RobotLine:
    """The line to one robot.

    Attributes:
        bus: Of the robot.
        said: What it has said last.
        said_at_s: When, wall time (monotonic).
        fresh: Whether it has said something since it was asked last.
    """

    def __init__(self, bus: Bus) -> None:
        self.bus = bus
        self._inbox = bus.inbox([topics.WHEREABOUTS], keep="recent")
        self._guidance = bus.publisher(topics.GUIDANCE)
        self.said: m.Whereabouts | None = None
        self.said_at_s, self.fresh = time.monotonic(), False

    @property
    def tick(self) -> int:
        """Of what it has said last; −1 before."""
        return round(100 * self.said.stamp_s) if self.said is not None else -1

    def listen(self, now_s: float) -> None:
        """Take what it has said."""
        for _, message in self._inbox.messages():
            if isinstance(message, m.Whereabouts):
                self.said, self.said_at_s, self.fresh = message, now_s, True

    def tell(self, told: Sequence[m.Guidance], tick: int) -> None:
        """Tell it something, at least that it is answered; `tick` is that of its whereabouts."""
        stamp = m.Time(sec=tick // 100, nanosec=tick % 100 * 10_000_000)
        head = m.Header(stamp=stamp, frame_id=_MAP)
        for message in told or [m.Guidance(echo_s=NOTHING_HEARD_S)]:
            self._guidance.send(message.model_copy(update={"header": head}))


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
        self._lines = {name: RobotLine(bus.of(name)) for name in team.names}
        self._step = self._exchange.step_ticks if lockstep else SAYING_TICKS
        self._next_tick = self._step
        self._offsets: dict[str, int] = {}
        self._roster, self._look_at_s = bus.roster(), 0.0
        self._tasks, self._stops = bus.serve(topics.TEAM_TASK), bus.serve(topics.TEAM_STOP)
        self._cells, self._status = bus.publisher(topics.TEAM_CELLS), bus.publisher(topics.TEAM_STATUS)
        self._setup = bus.publisher(topics.TEAM_SETUP)
        self._setup.send(m.String(data=team.model_dump_json()))
        self._task, self._problem, self._updates = "", "", 0
        self._phase = _Phase.WAITING
        self._muster: Muster | None = None
        self._absent: set[str] = set()
        self._call: ServedCall[m.TeamTaskRequest, m.TeamTaskResponse] | None = None

    def _begin(self, call: ServedCall[m.TeamTaskRequest, m.TeamTaskResponse]) -> None:
        """Have all robots be guided from now on; the call is answered when all have answered."""
        self._muster = Muster({name: line.bus for name, line in self._lines.items()}, self._lockstep_s)
        self._call, self._phase = call, _Phase.BEGINNING

    @property
    def _lockstep_s(self) -> float:
        return self._step / 100.0 if self._lockstep else 0.0

    def _look_at_muster(self) -> None:
        """Begin, or wait for another task, once all robots have answered; or take in those that have come."""
        muster, call = self._muster, self._call
        if muster is None or not muster.done:
            return
        self._muster = None
        if call is None:
            for name, reason in muster.refused.items():
                sys.stderr.write(f"warning: {name} does not join yet: {reason}\n")
            self._absent = set(muster.refused)  # one that has just come to the bus does not serve before it is ready
            return
        self._call = None
        if muster.refused:
            self._phase = _Phase.WAITING
            self._call_all(topics.ABORT)
            call.reply(m.TeamTaskResponse(success=False, message=str(muster)))
            return
        self._phase, now_s = _Phase.GUIDING, time.monotonic()
        for line in self._lines.values():
            line.said_at_s = now_s
        call.reply(m.TeamTaskResponse(success=True, message=f"the team's task is {self._task}"))

    def turn(self) -> bool:
        """Serve what waits, and exchange messages if that is due; False if there was nothing to do."""
        now_s = time.monotonic()
        for line in self._lines.values():
            line.listen(now_s)
        self._serve()
        self._look_at_muster()
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
        if any(line.tick < tick and not _given_up(line, now_s) for line in self._lines.values()):
            return False
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
        if self._exchange.updated:
            self._publish(tick)
            if self._lockstep and self._coordination.finished(tick / 100.0):
                self._phase = _Phase.ENDED
                self._call_all(topics.ABORT)
        return told

    def _publish(self, tick: int) -> None:
        self._updates += 1
        stamp = m.Time(sec=tick // 100, nanosec=tick % 100 * 10_000_000)
        head = m.Header(stamp=stamp, frame_id=_MAP)
        self._cells.send(m.TeamCells(header=head, cells=tuple(self._coordination.cells())))
        status = team_status(self._coordination, self._area)
        figures = {"header": head, "task": self._task, "updates": self._updates, "robots": len(self._lines)}
        self._status.send(status.model_copy(update=figures | ({"problem": self._problem} if self._problem else {})))

    def _serve(self) -> None:
        if (task := self._tasks.poll()) is not None:
            self._take_task(task)
        if (stop := self._stops.poll()) is not None:
            refused = self._stop_all()
            stop.reply(m.CommandResponse(success=not refused, message="; ".join(refused) or "all robots are paused"))

    def _take_task(self, call: ServedCall[m.TeamTaskRequest, m.TeamTaskResponse]) -> None:
        """The first task sets the team in motion; later ones replace it."""
        try:
            spec = parse_task(call.request.task_json)
            if self._phase is _Phase.GUIDING:
                self._coordination.set_task(spec)
            elif self._phase is not _Phase.WAITING:
                raise SpecError("team", "task", f"comes while the team {self._phase.value}", "send it later, or anew")
        except SpecError as error:
            call.reply(m.TeamTaskResponse(success=False, message=str(error)))
            return
        self._task = spec.kind
        if self._phase is _Phase.WAITING:
            self._coordination.set_first_task(spec)
            self._begin(call)
            return
        call.reply(m.TeamTaskResponse(success=True, message=f"the team's task is {spec.kind}"))

    def _stop_all(self) -> list[str]:
        """Pause every robot; returns who does not answer."""
        return self._call_all(topics.PAUSE)

    def _call_all(self, service: Service[m.CommandRequest, m.CommandResponse]) -> list[str]:
        """Give every robot the same command; returns who does not answer."""
        request = encode(m.CommandRequest(request_id=uuid.uuid4().hex))
        asked = {name: line.bus.ask(service, request, SILENT_S) for name, line in self._lines.items()}
        found = []
        for name, question in asked.items():
            deadline = time.monotonic() + SILENT_S
            while (answer := question.poll()) is None and time.monotonic() < deadline:
                time.sleep(IDLE_S)
            if answer is None or answer.payload is None:
                found.append(f"{name} does not answer")
        return found

    def _look_for_robots(self, now_s: float) -> None:
        """Take in robots that have come to the bus."""
        self._roster.poll()
        if now_s < self._look_at_s:
            return
        self._look_at_s = now_s + _LOOK_S
        there = self._roster.robots((topics.ROBOT_SIM,))
        new = [name for name in there if name not in self._lines or name in self._absent]
        if new and self._muster is None:
            for name in new:
                if name not in self._lines:
                    self._lines[name] = RobotLine(self._bus.of(name))
            self._muster = Muster({name: self._lines[name].bus for name in new}, self._lockstep_s)

    @property
    def figures(self) -> dict[str, object]:
        """For the diagnostics."""
        return {"robots": len(self._lines), "updates": self._updates, "sim_time_s": self._next_tick / 100.0}

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
        raise first_problem(error, "task", {}) from error
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
        warm_up_team(team, area)
        service = TeamService(bus, team, area, lockstep=lockstep)
        while not stop:
            if not service.turn():
                time.sleep(IDLE_S)
            health.poll(service.figures, message=service.doing)
