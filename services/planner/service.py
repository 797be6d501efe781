"""Planner process: answers the plan requests of all robots on the bus, with progress and diagnostics."""

import logging
import queue
import threading
import time
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

_LOG = logging.getLogger(__name__)
# Period (s) of the main loop, which polls for requests, finished plans and the end.
TURN_S = 0.01
# Period (s) of polling for diagnostics requests, which for many robots takes longer than polling for plan requests.
HEALTH_EVERY_S = 0.05
# Requests of a robot that may wait for the one being planned; more are refused.
WAITING_MAX = 8
# Step of progress that is published; every new stage is published, too.
PROGRESS_STEP = 0.02

PlanCall = ServedCall[PlanRequest, PlanResponse]


class PendingRequest(NamedTuple):
    """A request, and the number of the robot that it is for."""

    call: PlanCall
    robot: int


class StageProgress(NamedTuple):
    """Progress of a robot's plan."""

    progress: Progress
    robot: int


class Stopping(Exception):
    """Raised to end planning when the service stops."""


@dataclass
class Planned:
    """A finished request: the answer, or None if planning failed unexpectedly."""

    pending: PendingRequest
    response: PlanResponse | None


@dataclass
class Worker:
    """Thread that plans one request after another, while the bus is served.

    The thread never touches the bus: its `messages` wait for the main thread. `warm` is set once it has its kernels;
    until then, `doing` describes the step of the warm-up.
    """

    vehicles: Sequence[Vehicle]
    calls: "queue.SimpleQueue[PendingRequest]" = field(default_factory=queue.SimpleQueue)
    messages: "queue.SimpleQueue[StageProgress | Planned]" = field(default_factory=queue.SimpleQueue)
    warm: threading.Event = field(default_factory=threading.Event)
    stopping: threading.Event = field(default_factory=threading.Event)
    doing: str = "loading kernels"

    def start(self) -> threading.Thread:
        """Start the thread, which ends with the process."""
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
            pending = self.calls.get()
            try:
                response: PlanResponse | None = answer(pending.call.request, self.vehicles[0], self._reporter(pending))
            except Stopping:
                return
            except Exception:  # noqa: BLE001, a defect of the planner must not end the service
                _LOG.exception("a plan request failed")
                response = None
            self.messages.put(Planned(pending, response))

    def _warm_up(self) -> None:
        """Load or compile the kernels, before anyone waits for them."""
        from touchline.services.planner.warm_up_planner import planner_steps

        for vehicle in dict.fromkeys(self.vehicles):
            run_steps(planner_steps(vehicle), self._report)
        self.warm.set()

    def _report(self, doing: str) -> None:
        if self.stopping.is_set():
            raise Stopping
        self.doing = doing

    def _reporter(self, pending: PendingRequest) -> "ProgressReporter":
        return ProgressReporter(pending, self.messages, self.stopping)


@dataclass
class ProgressReporter:
    """Reports the progress of one request in steps of `PROGRESS_STEP`."""

    pending: PendingRequest
    messages: "queue.SimpleQueue[StageProgress | Planned]"
    stopping: threading.Event
    stage: str = ""
    fraction: float = 0.0

    def __call__(self, stage: str, fraction: float) -> None:
        """Report that `fraction` of `stage` is done."""
        if self.stopping.is_set():
            raise Stopping
        if stage == self.stage and fraction < min(self.fraction + PROGRESS_STEP, 1.0):
            return
        self.stage, self.fraction = stage, fraction
        progress = Progress(request_id=self.pending.call.request_id, stage=stage, fraction=fraction)
        self.messages.put(StageProgress(progress, self.pending.robot))


@dataclass
class RequestTally:
    """Counts of requests, for the diagnostics of the service."""

    planned: int = 0
    refused: int = 0
    failed: int = 0
    planning_time_s: float = 0.0
    waiting: list[PendingRequest] = field(default_factory=list)

    def values(self) -> dict[str, object]:
        """Key-value pairs of the diagnostics."""
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
        config: Bus configuration, with the robots that are served.
        vehicles: Vehicles for which kernels are compiled before the first request; a request without a vehicle is for
            the first of them, by default the shipped marker.
        supervisor: Process id of the parent, with which the service ends.

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
            if worker.warm.is_set():  # until then loading kernels holds up every thread
                stop.beat()
                late.watch()
            wait_s = TURN_S  # for the first robot; the others are only polled
            for robot, server in enumerate(servers):
                if (call := server.wait(wait_s)) is not None:
                    _admit(PendingRequest(call, robot), worker, tally)
                wait_s = 0.0
            if not worker.messages.empty():
                with stop.beating():  # a large plan takes a while to serialise
                    _pass_on(worker, progress, tally, config.namespaces)
            if time.monotonic() >= health_at_s:
                health_at_s = time.monotonic() + HEALTH_EVERY_S
                level, message = condition(worker, tally, late.current)
                for reporter in health:
                    reporter.poll({**tally.values(), **late.values()}, level=level, message=message)
        worker.stopping.set()
        for pending in tally.waiting:
            pending.call.fail("the planner is stopping; ask again when it is back")


def condition(worker: Worker, tally: RequestTally, compiling: str = "") -> tuple[int, str]:
    """Level and message of the planner's diagnostics.

    Args:
        worker: Planning thread.
        tally: Counts of the requests.
        compiling: Kernel that is being compiled for a request with a new plug-in or vehicle; "" if none is.
    """
    if not worker.warm.is_set():
        return DiagnosticStatus.WARN, f"{STARTING}{worker.doing}"
    if compiling:
        return DiagnosticStatus.WARN, f"{STARTING}compiling {compiling} for the first plan of its kind"
    level = DiagnosticStatus.WARN if tally.failed else DiagnosticStatus.OK
    return level, "planning" if tally.waiting else "ready"


def _admit(pending: PendingRequest, worker: Worker, tally: RequestTally) -> None:
    before = sum(other.robot == pending.robot for other in tally.waiting)
    if before > WAITING_MAX:
        tally.refused += 1
        pending.call.fail(f"the planner is busy with {before} requests; ask again later")
        return
    tally.waiting.append(pending)
    worker.calls.put(pending)


def _pass_on(worker: Worker, progress: Sequence[Publisher], tally: RequestTally, robots: Sequence[str]) -> None:
    """Publish the worker's progress, and answer finished requests."""
    while not worker.messages.empty():
        message = worker.messages.get()
        if isinstance(message, StageProgress):
            progress[message.robot].send(message.progress)
            continue
        tally.waiting.remove(message.pending)
        call = message.pending.call
        if message.response is None:
            tally.failed += 1
            call.fail("the planner failed on this request: a defect; its log has the details")
            continue
        tally.planned += message.response.success
        tally.refused += not message.response.success
        outcome = "planned" if message.response.success else f"refused: {message.response.message}"
        _LOG.info("plan request of %s: %s", robots[message.pending.robot], outcome)
        tally.planning_time_s = message.response.report.planning_time_s
        call.reply(message.response)
