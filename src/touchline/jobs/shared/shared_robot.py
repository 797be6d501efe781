"""Robot of a shared job on the bus: its messages, and the requests to it."""

import math
import time
import uuid
from collections.abc import Callable
from contextlib import suppress
from typing import Final

from touchline.bus import Bus, CallError, ServedCall
from touchline.coordination.body_contacts import PRESSED
from touchline.jobs.shared.assignment import Assignment, AssignmentStatus
from touchline.jobs.shared.claimed_stretch import NOTHING, ClaimedStretch
from touchline.jobs.shared.joint_paint import Work
from touchline.jobs.shared.reported_work import ReportedTruth, pose_of
from touchline.jobs.shared.unfinished_lines import Standing
from touchline.jobs.single.stale_reports import JobMessageFilter
from touchline.jobs.single.stall_detector import waits_for_operator
from touchline.jobs.watcher import JobFailed
from touchline.onboard.interface import PaintBelief
from touchline.schemas import topics
from touchline.schemas.messages import (
    AreaReport,
    AuthorizeRequest,
    CommandRequest,
    CommandResponse,
    Event,
    GetPaintRequest,
    InjectFaultRequest,
    LoadRequest,
    Odometry,
    PaintMarks,
    PauseStatus,
    SetSpeedRequest,
    TraversalReport,
    TraversalStatus,
)
from touchline.schemas.topics import Request, Response, Service
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.settling import RESTING_MPS

_CALL_S: Final = 10.0
_LOAD_S: Final = 30.0
"""Timeout of a load, which is refused while the robot is coming to rest: a second of sim time."""
_LOOK_S: Final = 0.005
_AT_M: Final = 0.1
"""Distance to its authority's end within which a standing robot counts as held."""
_TRUTH_WITHIN_S: Final = 0.05
"""Largest age of its reported truth relative to its status."""
_UNDER_WAY: Final = (TraversalStatus.READY, TraversalStatus.RUNNING, TraversalStatus.PAUSED)
_ABLE: Final = (TraversalStatus.RUNNING, TraversalStatus.PAUSED, TraversalStatus.DONE)


class SharedRobot:
    """Proxy of one robot on the bus.

    Attributes:
        bus: Its own bus.
        truth: Its reported truth during the present assignment.
        status: Its last status.
        report, area: Reports of the finished assignment; `area` if a covering tool has worked on areas.
        finished: True if it has finished its assignment.
        furthest_m: Largest reported arc length.
        until_m: Arc length up to which it was authorized.
        limit_m: Upper bound of its authority, whatever the traffic rules allow.
        out: Reason why it is out of service; "" while it is not.
        out_at: Start of that, wall clock (monotonic).
        lost: True if its process is gone: a process that comes back has no part in this job.
        gone: True if it was carried away since.
        assignment: Its assignment, until that is put aside.
        stretch: Stretch of its path that it has for itself.
        strokes, reports, areas, works: Results of assignments that were put aside.
        ended_s: End of the last of these, on the clock that all robots share.
    """

    def __init__(self, bus: Bus, vehicle: Vehicle, tell: Callable[[int, str], None]) -> None:
        """Subscribe before the robot gets an assignment.

        Args:
            bus: Bus of the robot.
            vehicle: Its vehicle.
            tell: Called with severity and text of its events.
        """
        self.bus, self._tell, self._vehicle = bus, tell, vehicle
        self._reports = bus.inbox([topics.EVENTS, topics.AREA_REPORT, topics.REPORT])
        self._latest = bus.inbox([topics.STATUS, topics.PAUSE_STATUS, topics.ODOMETRY], keep="latest")
        self.truth = ReportedTruth(bus, vehicle)
        self._presence = bus.presence()
        self._take_over, self._remove = bus.serve(topics.TAKE_OVER), bus.serve(topics.REMOVE)
        self._filter, self._place = JobMessageFilter(), Odometry()
        self._paused_at, self._pause = math.inf, PauseStatus()
        self.status = TraversalStatus()
        self.report: TraversalReport | None = None
        self.area: AreaReport | None = None
        self.furthest_m, self.until_m, self.limit_m = 0.0, math.inf, math.inf
        self.finished = self._called_off = False
        self.out, self.out_at = "", 0.0
        self.lost = self.gone = False
        self.assignment: Assignment | None = None
        self.stretch = ClaimedStretch(bus.publisher(topics.CLAIMED).send)
        self.strokes: list[PaintMarks] = []
        self.reports: list[TraversalReport] = []
        self.areas: list[AreaReport] = []
        self.works: list[Work] = []
        self.ended_s = 0.0

    @property
    def name(self) -> str:
        """Namespace of the robot."""
        return self.bus.namespace

    @property
    def done(self) -> bool:
        """True if it has reported the end of its assignment."""
        return self.finished and self.report is not None

    @property
    def progress_m(self) -> float:
        """Reported arc length; infinite once it is done."""
        return math.inf if self.finished else self.furthest_m

    def claim(self) -> None:
        """Claim its path from the passed part to the end of its authority."""
        if self.assignment is None or self.finished or self._called_off:
            self.stretch.claim(*NOTHING)
        else:
            self.stretch.claim(self.furthest_m, min(self.until_m, self.assignment.path.end_m))

    @property
    def rests(self) -> bool:
        """True if it stands: held, paused, or with nothing to do."""
        held = self.status.state != TraversalStatus.RUNNING or self.until_m - self.furthest_m < _AT_M
        return held and abs(self.status.speed_mps) < RESTING_MPS

    @property
    def stands(self) -> bool:
        """True if its true poses are complete: it does not drive, and all of them have arrived."""
        driven = self.status.state != TraversalStatus.RUNNING and self.truth.time_s > self.time_s - _TRUTH_WITHIN_S
        return self.lost or driven

    @property
    def place(self) -> Standing:
        """Estimated pose, or the last one received."""
        return Standing(self.name, pose_of(self._place))

    @property
    def paused_since(self) -> float | None:
        """Time (seconds since the epoch) at which an operator paused it; None if it is not paused."""
        return self._paused_at if math.isfinite(self._paused_at) and not self.out else None

    @property
    def painted(self) -> PaintBelief:
        """Parts of its assignment that it has painted, by its own record."""
        status = self.status
        return PaintBelief(status.painted_ids, status.painted_fraction.tolist(), status.coverage_pct)

    @property
    def assignment_statuses(self) -> list[AssignmentStatus]:
        """Status of its assignment, if it has one."""
        return [] if self.assignment is None else [AssignmentStatus(self.assignment, self.painted, self.progress_m)]

    @property
    def time_s(self) -> float:
        """Sim time of its status, on its own clock."""
        return self.status.header.stamp.seconds

    @property
    def shared_s(self) -> float:
        """Sim time of its status, on the clock that all robots share."""
        return self.time_s + self.truth.ahead_s

    def listen(self) -> None:
        """Receive new messages; those older than its assignment are ignored."""
        gone = any(each.node == topics.ROBOT_SIM and not each.alive for each in self._presence.poll())
        if not self.lost:
            self._hear()
        if gone and not self.lost:
            self.lost = True
            self.fail("its process is gone")

    def _hear(self) -> None:
        for _, message in self._reports.messages():
            if isinstance(message, Event):
                self._tell(message.severity, f"{self.name}: {message.text}")
            elif isinstance(message, TraversalReport) and self._filter.report(message):
                self.report = message
            elif isinstance(message, AreaReport) and self._filter.report(message):
                self.area = message
        for _, message in self._latest.messages():
            if isinstance(message, Odometry):
                self._place = message
            elif isinstance(message, TraversalStatus) and self._belongs_to_assignment(message):
                self.status, self.finished = message, self.finished or message.state == TraversalStatus.DONE
                if message.state == TraversalStatus.RUNNING:
                    self.truth.put_down()
                self.furthest_m = max(self.furthest_m, message.arc_length_m)
            elif isinstance(message, PauseStatus):
                self._pause = message
        waits = waits_for_operator(self.status, self._pause)
        self._paused_at = min(self._paused_at, time.time()) if waits else math.inf
        self.truth.listen()

    def _belongs_to_assignment(self, status: TraversalStatus) -> bool:
        """Return True if a status belongs to the assignment: not older, nor sent after it was cleared."""
        cleared = self.assignment is not None and status.state == TraversalStatus.IDLE
        return self._filter.status(status) and not cleared

    def look(self) -> None:
        """Note a failure, or that the robot was set going again on the bus."""
        aborted = self.status.state == TraversalStatus.ABORTED and not self._called_off
        stopped = self.assignment is not None and (aborted or self.status.state == TraversalStatus.ESTOPPED)
        if stopped and not self.out:
            self.fail(self.status.reason or "it has stopped")
        elif self.out and not self.lost and self.assignment is not None and self.status.state in _ABLE:
            self.out = ""

    def call_off(self) -> None:
        """Abort its assignment where it stands, without counting that as a failure."""
        if self.status.state in _UNDER_WAY:
            self._called_off = True
            self.command(topics.ABORT)

    def fail(self, why: str) -> None:
        """Put it out of service."""
        self.out, self.out_at = why, time.monotonic()

    def orders(self) -> list[tuple[str, ServedCall[CommandRequest, CommandResponse]]]:
        """Return operators' orders concerning it, "take-over" or "remove"; each is to be answered."""
        found = list[tuple[str, ServedCall[CommandRequest, CommandResponse]]]()
        for kind, server in (("take-over", self._take_over), ("remove", self._remove)):
            while (call := server.poll()) is not None:
                found.append((kind, call))
        return found

    def ask(self, service: Service[Request, Response], request: Request, timeout_s: float = _CALL_S) -> Response | None:
        """Call a service of the robot.

        Args:
            service: Service to call.
            request: Request to send.
            timeout_s: Wall-clock time to wait for the answer.

        Returns:
            The answer; None if its process is gone meanwhile.

        Raises:
            JobFailed: It refuses.
            CallError: It does not answer.
        """
        if self.lost:
            return None
        try:
            response = self.bus.call(service, request, timeout_s, self._check)
        except CallError:
            if self._has_left():
                return None
            raise
        if not getattr(response, "success", True):
            raise JobFailed(f"robot {self.name} refuses {service.name}: {getattr(response, 'message', '')}")
        return response

    def _has_left(self) -> bool:
        self.listen()
        return self.lost

    def _check(self) -> None:
        if self._has_left():
            raise _Lost

    def command(self, service: Service[CommandRequest, CommandResponse]) -> None:
        """Call a service without arguments, as `ask`."""
        self.ask(service, CommandRequest(request_id=fresh_id()))

    def set_speed(self, factor: float) -> None:
        """Set sim seconds per wall second; 0 stops its clock."""
        self.ask(topics.SET_SPEED, SetSpeedRequest(request_id=fresh_id(), factor=factor))

    def authorize(self, until_m: float) -> None:
        """Authorize it to drive up to an arc length, unless it already is."""
        if until_m != self.until_m:
            self.ask(topics.AUTHORIZE, AuthorizeRequest(request_id=fresh_id(), until_m=until_m))
            self.until_m = until_m

    def touch(self) -> None:
        """Trigger its bumper, as for a contact."""
        request = InjectFaultRequest(request_id=fresh_id(), fault_json=PRESSED.model_dump_json())
        with suppress(JobFailed, CallError):  # the contact is reported and counted whether or not it stops
            self.ask(topics.INJECT_FAULT, request)

    def keep_out(self) -> None:
        """Keep it from driving further on its assignment, should it be set going again: others do the rest."""
        with suppress(JobFailed):  # it may have been aborted already
            self.authorize(0.0)

    def take(self, assignment: Assignment, begun_s: float, *, here: bool) -> None:
        """Load an assignment; earlier messages no longer count.

        Args:
            assignment: The assignment.
            begun_s: Start of the assignment, on the clock that all robots share.
            here: True if it begins where the robot stands; otherwise the robot is placed at the start.

        Raises:
            JobFailed: It refuses for longer than it takes to come to rest, or does not report that it is ready.
        """
        if not here:
            self.truth.carry()
        self._filter.forget()
        self.report, self.area, self._called_off = None, None, False
        self.status, self.furthest_m, self.finished = TraversalStatus(), 0.0, False
        self.until_m = self.limit_m = math.inf
        trajectory, text = assignment.plan.trajectory, assignment.share.to_json()
        deadline = time.monotonic() + _LOAD_S
        while True:
            load = LoadRequest(request_id=fresh_id(), trajectory=trajectory, template_json=text, here=here)
            try:
                self.ask(topics.LOAD, load, _LOAD_S)
            except JobFailed:
                if not here or time.monotonic() > deadline:
                    raise
                time.sleep(0.05)
            else:
                break
        self.assignment = assignment
        while not (self._filter.begun or self.lost):
            if time.monotonic() > deadline:
                raise JobFailed(f"robot {self.name} has taken its part, but does not report that it is ready")
            self.listen()
            time.sleep(_LOOK_S)
        if self._filter.begun:
            self.truth.begin(self._filter.since_s, begun_s)
        self.stretch.take(trajectory.path.segments, self._vehicle)

    def conclude(self) -> None:
        """Put its assignment aside with its paint.

        A process that is gone cannot be asked for its paint; in that case its messages are used.
        """
        if self.assignment is None:
            return
        answer = self.ask(topics.GET_PAINT, GetPaintRequest(), 30.0)
        strokes = self.truth.strokes() if answer is None else answer.strokes
        self.works.append(self.truth.work(self.assignment.share, strokes))
        self.strokes += strokes
        if self.report is not None:
            self.reports.append(self.report)
            self.ended_s = max(self.ended_s, self.report.header.stamp.seconds + self.truth.ahead_s)
        if self.area is not None:
            self.areas.append(self.area)
        self.assignment = None


class _Lost(CallError):
    """The called process is gone."""


def fresh_id() -> str:
    """Return a fresh request id."""
    return uuid.uuid4().hex
