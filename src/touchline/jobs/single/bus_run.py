"""One job over the bus: plan, record, load, start, follow to the end, report."""

import time
import uuid
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from touchline.bus import Bus, CallError, Inbox
from touchline.bus.counters import Counters
from touchline.jobs.recording.recording_end import end_recording, lacking
from touchline.jobs.single.reports import (
    contact_figures,
    failing,
    hash_figures,
    plan_figures,
    traversal_figures,
    work_report,
)
from touchline.jobs.single.stale_reports import JobMessageFilter
from touchline.jobs.single.stall_detector import StallDetector
from touchline.jobs.watcher import JobFailed, Watcher
from touchline.schemas import topics
from touchline.schemas.errors import PayloadError, TouchlineError
from touchline.schemas.messages import (
    AreaReport,
    CommandRequest,
    ContactReport,
    Event,
    GetDiagnosticsRequest,
    LoadRequest,
    PauseStatus,
    PlanOptions,
    PlanRequest,
    PlanResponse,
    Progress,
    RecordRequest,
    RecordStopRequest,
    SetSpeedRequest,
    TraversalReport,
    TraversalStatus,
)
from touchline.schemas.messages.base import Message
from touchline.schemas.plan_cause import PlanCause
from touchline.schemas.supplies import full
from touchline.schemas.topics import Request, Response, Service
from touchline.schemas.vehicles import Vehicle
from touchline.supervision.diagnostics import read_health

_PLAN_TIMEOUT_S = 600.0
_READY_TIMEOUT_S = 10.0
_FINISHED = (TraversalStatus.DONE, TraversalStatus.ABORTED, TraversalStatus.ESTOPPED)


@dataclass(frozen=True)
class JobOptions:
    """Subject and settings of a job.

    Attributes:
        template_json: The template's text.
        plan: Planning options.
        speed: Sim seconds per wall second; negative for as fast as possible.
        record: File to record to, if any.
        scenario_hash: Hash of all inputs of the session, for the report.
        vehicle: The robot's vehicle; tank and battery are full at the start.
    """

    template_json: str
    plan: PlanOptions
    speed: float
    record: Path | None
    scenario_hash: str = ""
    vehicle: Vehicle = field(default_factory=Vehicle)


@dataclass
class BusRun:
    """A job in progress on ``bus``, reported to ``watcher``."""

    doing: ClassVar[str] = "Painting"
    bus: Bus
    options: JobOptions
    watcher: Watcher
    started_at: float = field(default=0.0, init=False)
    """Wall clock (monotonic) of the start."""
    report: TraversalReport = field(default=TraversalReport(), init=False)
    """Report of the traversal, once the job is done."""
    area: AreaReport | None = field(default=None, init=False)
    """Report of the areas, once the job is done, if a covering tool has worked on some."""
    contacts: ContactReport | None = field(default=None, init=False)
    """Report of contacts with things, once the job is done, if there were any."""
    _reported: bool = field(default=False, init=False)
    _of_job: JobMessageFilter = field(default_factory=JobMessageFilter, init=False)

    def run(self) -> dict[str, Any]:
        """Do the whole job.

        Returns:
            The run report.

        Raises:
            JobFailed: A service refused, died, or the robot stopped for good.
            CallError: A service did not answer.
        """
        inbox = self.bus.inbox(
            [topics.EVENTS, topics.AREA_REPORT, topics.CONTACT_REPORT, topics.WAY_ROUND, topics.REPORT]
        )
        latest = self.bus.inbox([topics.STATUS], keep="latest")
        pauses = self.bus.inbox([topics.PAUSE_STATUS], keep="latest")
        plan = self._plan()
        recording = self._start_recording()
        try:
            self._load_and_start(plan, latest)
            status = self._follow(inbox, latest, pauses)
        except (TouchlineError, KeyboardInterrupt):
            self._give_up(recording)
            raise
        wall_s = time.monotonic() - self.started_at
        recorded = self._stop_recording()
        return self._report(plan, status, wall_s, recorded)

    def _plan(self) -> PlanResponse:
        self.watcher.stage("Planning")
        progress = self.bus.inbox([topics.PLANNER_PROGRESS], keep="latest")

        def show() -> None:
            self.watcher.check()
            for _, message in progress.messages():
                if isinstance(message, Progress):
                    self.watcher.progress(message.fraction, message.stage)

        request = PlanRequest(
            request_id=_new_id(),
            template_json=self.options.template_json,
            vehicle_json=self.options.vehicle.model_dump_json(),
            options=self.options.plan,
        )
        response = self._ask(topics.PLAN_SERVICE, request, _PLAN_TIMEOUT_S, show)
        if not response.success:
            raise JobFailed(response.message)
        for shortage in full(response.report, self.options.vehicle).shortages:
            self.watcher.event(Event.WARN, f"planner: the job {shortage}")
        for stretch in response.report.left_out:
            self.watcher.event(Event.WARN, f"planner: the plan leaves out {stretch.words}")
        return response

    def _cause(self, plan: PlanResponse) -> PlanCause:
        """Return the inputs of the plan."""
        return PlanCause.of(self.options.plan, plan.report)

    def _start_recording(self) -> Path | None:
        if self.options.record is None:
            return None
        request = RecordRequest(request_id=_new_id(), path=str(self.options.record.absolute()))
        response = self._ask(topics.RECORD, request)
        if not response.success:
            raise JobFailed(response.message)
        return self.options.record

    def _load_and_start(self, plan: PlanResponse, latest: Inbox) -> None:
        self.watcher.stage(self.doing)
        load = LoadRequest(
            request_id=_new_id(),
            trajectory=plan.trajectory,
            template_json=self.options.template_json,
            cause_json=self._cause(plan).model_dump_json(),
        )
        loaded = self._ask(topics.LOAD, load)
        if not loaded.success:
            raise JobFailed(f"the robot refused the plan: {loaded.message}")
        deadline = time.monotonic() + _READY_TIMEOUT_S
        while not any(self._of_job.status(status) for status in _statuses(latest)):
            self.watcher.check()
            if time.monotonic() > deadline:
                raise JobFailed("the robot has taken the plan, but does not report that it is ready")
            time.sleep(0.005)
        speed = SetSpeedRequest(request_id=_new_id(), factor=self.options.speed)
        paced = self._ask(topics.SET_SPEED, speed)
        if not paced.success:
            raise JobFailed(paced.message)
        self._before_start()
        started = self._ask(topics.START, CommandRequest(request_id=_new_id()))
        if not started.success:
            raise JobFailed(f"the robot refused to start: {started.message}")
        self.started_at = time.monotonic()

    def _before_start(self) -> None:
        """Prepare a robot that is ready to start."""

    def _each_turn(self) -> None:
        """Attend to a robot under way, about a hundred times a second."""

    def _hear(self, message: Message) -> None:
        """Take a message of the robot's."""
        if isinstance(message, Event):
            self.watcher.event(message.severity, f"{message.source}: {message.text}")
        elif isinstance(message, AreaReport) and self._of_job.report(message):
            self.area = message
        elif isinstance(message, ContactReport) and self._of_job.report(message):
            self.contacts = message
        elif isinstance(message, TraversalReport) and self._of_job.report(message):
            self.report, self._reported = message, True

    @property
    def _over(self) -> bool:
        """True once the robot has reported the end of the job."""
        return self._reported

    def _follow(self, inbox: Inbox, latest: Inbox, pauses: Inbox) -> TraversalStatus:
        status, pause, patience, moved_to = TraversalStatus(), PauseStatus(), StallDetector(), -1.0
        while True:
            self.watcher.check()
            for _, message in inbox.messages():
                self._hear(message)
            if self._over:
                return next(_statuses(latest), status)
            self._each_turn()
            status = next(_statuses(latest), status)
            pause = next((message for _, message in pauses.messages() if isinstance(message, PauseStatus)), pause)
            if status.arc_length_m != moved_to:
                moved_to = status.arc_length_m
                fraction = status.arc_length_m / status.total_length_m if status.total_length_m else 0.0
                self.watcher.progress(fraction, f"{status.segment_id}  {status.coverage_pct:.1f} % done")
            if (why := patience.stalled(status, pause)) and status.state not in _FINISHED:
                raise JobFailed(why)
            time.sleep(0.01)

    def _stop_recording(self) -> dict[str, Any] | None:
        if self.options.record is None:
            return None
        self.watcher.stage("Finishing the recording")
        report = end_recording(self.bus, partial(self.watcher.event, Event.WARN), self.watcher.check)
        figures: dict[str, Any] = {"path": str(self.options.record), "complete": False}
        if (
            report is not None and Path(report.path).name == self.options.record.name
        ):  # it says little about a next part
            figures |= {"messages": report.messages, "bytes": report.bytes, "lost": report.lost}
        problem = lacking(report, self.options.record)
        return figures | ({"problem": problem} if problem else {"complete": True})

    def _give_up(self, recording: Path | None) -> None:
        """Stop the robot and close the recording; services that do not answer any more are skipped."""
        self.watcher.stage("Stopping")
        try:
            self.bus.call(topics.ABORT, CommandRequest(request_id=_new_id()), timeout_s=2.0)
        except TouchlineError as error:
            self.watcher.event(Event.WARN, str(error))
        if recording is not None:
            try:
                self.bus.call(topics.RECORD_STOP, RecordStopRequest(request_id=_new_id()), timeout_s=30.0)
            except TouchlineError as error:
                self.watcher.event(Event.WARN, str(error))

    def _report(
        self,
        plan: PlanResponse,
        status: TraversalStatus,
        wall_s: float,
        recording: dict[str, Any] | None,
    ) -> dict[str, Any]:
        report = self.report
        lacking = recording["problem"] if recording is not None and not recording["complete"] else ""
        return {
            "success": report.success and not lacking,
            "reason": status.reason
            or (lacking and f"the recording is not complete: {lacking}")
            or failing(report, self.area, self.contacts),
            "plan": plan_figures(plan.report),
            "traversal": traversal_figures(report, wall_s),
            **work_report(report, self.area, plan.report),
            **contact_figures(self.contacts),
            "bus": self._bus_figures(),
            "recording": recording,
            "hash": hash_figures(self.options.scenario_hash, report),
        }

    def _bus_figures(self) -> dict[str, int]:
        """Return messages published, received and lost, summed over the diagnostics of all processes."""
        counters = [self.bus.counters]
        for node in (topics.PLANNER, topics.ROBOT_SIM, topics.TELEMETRY, topics.BRIDGE):
            try:
                response = self._ask(topics.diagnostics_service(node), GetDiagnosticsRequest())
            except (CallError, PayloadError) as error:
                self.watcher.event(Event.WARN, str(error))
                continue
            health = read_health(node, response.diagnostics)
            counters.append(Counters(health.published or 0, health.received or 0, health.lost or 0))
        return {
            "published": sum(each.published for each in counters),
            "received": sum(each.received for each in counters),
            "lost": sum(each.lost for each in counters),
        }

    def _ask(
        self,
        service: Service[Request, Response],
        request: Request,
        timeout_s: float = 10.0,
        while_waiting: Callable[[], None] | None = None,
    ) -> Response:
        return self.bus.call(service, request, timeout_s, while_waiting or self.watcher.check)


def _statuses(latest: Inbox) -> Iterator[TraversalStatus]:
    """Yield waiting statuses, one at most."""
    return (message for _, message in latest.messages() if isinstance(message, TraversalStatus))


def _new_id() -> str:
    return uuid.uuid4().hex
