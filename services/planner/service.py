"""The planner as a process: answers the plan requests of all robots on the bus, with progress and diagnostics."""

import queue
import sys
import threading
import time
import traceback
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from touchline.bus import Bus, BusConfig, HealthReporter, Publisher, ServedCall
from touchline.bus.health import STARTING
from touchline.core.compilations import run_steps
from touchline.schemas import topics
from touchline.schemas.messages import DiagnosticStatus, PlanRequest, PlanResponse, Progress
from touchline.schemas.vehicles import Vehicle
from touchline.supervision.late_compilations import LateCompilations
from touchline.supervision.shutdown import until_stopped

# How often the main thread looks for requests, finished plans and the end.
TURN_S = 0.01
# How often it looks whether anybody asks how it is; for many robots that takes longer than to look for requests.
HEALTH_EVERY_S = 0.05
# Requests of a robot that may wait for the one being planned; more are told to come back.
WAITING_MAX = 8
# Progress is published when it has grown by this much, and at every new stage.
PROGRESS_STEP = 0.02

PlanCall = ServedCall[PlanRequest, PlanResponse]


class Asked(NamedTuple):
    """A request, and the number of the robot for which it is."""

    call: PlanCall
    robot: int


class Told(NamedTuple):
    """How far a robot's plan is."""

    progress: Progress
    robot: int


class Stopping(Exception):
    """The service ends while a plan is being made."""


@dataclass
class Planned:
    """A finished request: the answer, or None if planning failed unexpectedly."""

    asked: Asked
    response: PlanResponse | None


@dataclass
class Worker:
    """Plans one request after another in a thread of its own, so the bus is served meanwhile.

    The thread never touches the bus: what it has to say waits in `said` for the main thread. `warm` is set once it has
    its kernels; until then, `doing` says how far it is.
    """

    vehicles: Sequence[Vehicle]
    calls: "queue.SimpleQueue[Asked]" = field(default_factory=queue.SimpleQueue)
    said: "queue.SimpleQueue[Told | Planned]" = field(default_factory=queue.SimpleQueue)
    warm: threading.Event = field(default_factory=threading.Event)
    stopping: threading.Event = field(default_factory=threading.Event)
    doing: str = "loading kernels"

    def start(self) -> threading.Thread:
        """Begin; the thread ends with the process."""
        thread = threading.Thread(target=self._work, name="planning", daemon=True)
        thread.start()
        return thread

    def _work(self) -> None:
        from touchline.services.planner.request import answer

        try:
            self._warm_up()
        except Stopping:
            return
        while not self.stopping.is_set():
            asked = self.calls.get()
            try:
                response: PlanResponse | None = answer(asked.call.request, self.vehicles[0], self._teller(asked))
            except Stopping:
                return
            except Exception:  # noqa: BLE001, a defect of the planner must not end the service
                traceback.print_exc(file=sys.stderr)
                response = None
            self.said.put(Planned(asked, response))

    def _warm_up(self) -> None:
        """Load or compile the kernels: here, where the bus is served meanwhile, before anyone waits for them."""
        from touchline.services.planner.warm_up_planner import planner_steps

        for vehicle in dict.fromkeys(self.vehicles):
            run_steps(planner_steps(vehicle), self._report)
        self.warm.set()

    def _report(self, doing: str) -> None:
        if self.stopping.is_set():
            raise Stopping
        self.doing = doing

    def _teller(self, asked: Asked) -> "ProgressTeller":
        return ProgressTeller(asked, self.said, self.stopping)


@dataclass
class ProgressTeller:
    """Passes on the progress of one request, thinned out."""

    asked: Asked
    said: "queue.SimpleQueue[Told | Planned]"
    stopping: threading.Event
    stage: str = ""
    fraction: float = 0.0

    def __call__(self, stage: str, fraction: float) -> None:
        """Note that `fraction` of `stage` is done."""
        if self.stopping.is_set():
            raise Stopping
        if stage == self.stage and fraction < min(self.fraction + PROGRESS_STEP, 1.0):
            return
        self.stage, self.fraction = stage, fraction
        progress = Progress(request_id=self.asked.call.request_id, stage=stage, fraction=fraction)
        self.said.put(Told(progress, self.asked.robot))


@dataclass
class RequestTally:
    """What the service has done, for its diagnostics."""

    planned: int = 0
    refused: int = 0
    failed: int = 0
    planning_time_s: float = 0.0
    waiting: list[Asked] = field(default_factory=list)

    def values(self) -> dict[str, object]:
        """The diagnostics' key-value pairs."""
        return {
            "plans": self.planned,
            "refused": self.refused,
            "failed": self.failed,
            "waiting": len(self.waiting),
            "last_planning_time_s": f"{self.planning_time_s:.3f}",
        }


def run_service(
    config: BusConfig | None = None, vehicles: Sequence[Vehicle] = (), *, supervisor: int | None = None
) -> None:
    """Serve `planner/plan` of all robots of `config` until SIGTERM or SIGINT (or until `supervisor` is gone).

    Args:
        config: Where the bus is, and the robots that may ask.
        vehicles: For which kernels are compiled before the first request; a request without a vehicle is for the
            first of them, by default the shipped marker.
        supervisor: Process id of the parent, to end with it.

    Raises:
        SpecError: The bus configuration cannot be used.
    """
    config = config or BusConfig.from_environment()
    with until_stopped(supervisor) as stop, Bus.open_all(topics.PLANNER, config, lambda: stop.asked) as buses:
        for bus in buses:
            bus.claim()
        worker, tally, late = Worker(vehicles or (Vehicle(),)), RequestTally(), LateCompilations(stop)
        servers, health = [bus.serve(topics.PLAN_SERVICE) for bus in buses], [HealthReporter(bus) for bus in buses]
        progress = [bus.publisher(topics.PLANNER_PROGRESS) for bus in buses]
        planning = worker.start()
        health_at_s = 0.0
        while not stop.asked:
            if not planning.is_alive():
                raise RuntimeError("the planning thread has ended")
            if worker.warm.is_set():  # until then the kernels, as they are loaded, hold up every thread
                stop.beat()
                late.watch()
            wait_s = TURN_S  # for the first robot; the others are only looked at
            for robot, server in enumerate(servers):
                if (call := server.wait(wait_s)) is not None:
                    _admit(Asked(call, robot), worker, tally)
                wait_s = 0.0
            if not worker.said.empty():
                with stop.beating():  # a large plan takes a while to be put into bytes
                    _pass_on(worker, progress, tally)
            if time.monotonic() >= health_at_s:
                health_at_s = time.monotonic() + HEALTH_EVERY_S
                level, message = condition(worker, tally, late.current)
                for reporter in health:
                    reporter.poll({**tally.values(), **late.values()}, level=level, message=message)
        worker.stopping.set()
        for asked in tally.waiting:
            asked.call.fail("the planner is stopping; ask again when it is back")


def condition(worker: Worker, tally: RequestTally, compiling: str = "") -> tuple[int, str]:
    """How the planner is: the level and the message of its diagnostics.

    Args:
        worker: That plans.
        tally: Of the requests.
        compiling: The kernel that is being compiled for a request, of a plug-in or a vehicle that is new.
    """
    if not worker.warm.is_set():
        return DiagnosticStatus.WARN, f"{STARTING}{worker.doing}"
    if compiling:
        return DiagnosticStatus.WARN, f"{STARTING}compiling {compiling} for the first plan of its kind"
    level = DiagnosticStatus.WARN if tally.failed else DiagnosticStatus.OK
    return level, "planning" if tally.waiting else "ready"


def _admit(asked: Asked, worker: Worker, tally: RequestTally) -> None:
    before = sum(other.robot == asked.robot for other in tally.waiting)
    if before > WAITING_MAX:
        tally.refused += 1
        asked.call.fail(f"the planner is busy with {before} requests; ask again later")
        return
    tally.waiting.append(asked)
    worker.calls.put(asked)


def _pass_on(worker: Worker, progress: Sequence[Publisher], tally: RequestTally) -> None:
    """Publish and answer what the worker has said."""
    while not worker.said.empty():
        said = worker.said.get()
        if isinstance(said, Told):
            progress[said.robot].send(said.progress)
            continue
        tally.waiting.remove(said.asked)
        call = said.asked.call
        if said.response is None:
            tally.failed += 1
            call.fail("the planner failed on this request: a defect; its log has the details")
            continue
        tally.planned += said.response.success
        tally.refused += not said.response.success
        tally.planning_time_s = said.response.report.planning_time_s
        call.reply(said.response)
