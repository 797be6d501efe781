"""One robot of a shared job on the bus: what it tells of itself, and what it is told."""

import math
import time
import uuid
from collections.abc import Callable
from contextlib import suppress
from typing import Final

from touchline.bus import Bus, CallError, ServedCall
from touchline.fleet.body_contacts import PRESSED
from touchline.jobs.shared.claimed_stretch import NOTHING, ClaimedStretch
from touchline.jobs.shared.errand import Errand, ErrandStatus
from touchline.jobs.shared.joint_paint import Work
from touchline.jobs.shared.remains import Standing
from touchline.jobs.shared.told_work import ToldTruth, pose_of
from touchline.jobs.single.patience import waits_for_operator
from touchline.jobs.single.stale_reports import SaidOfJob
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
from touchline.services.robot_sim.emulator import RESTING_MPS

_CALL_S: Final = 10.0
_LOAD_S: Final = 30.0
"""A load is refused for as long as the robot is coming to rest: a second of sim time."""
_LOOK_S: Final = 0.005
_AT_M: Final = 0.1
"""A robot that stands is held if it has come so near to where it may drive."""
_TRUTH_WITHIN_S: Final = 0.05
"""What it tells of its truth is no older than that when it tells its status."""
_UNDER_WAY: Final = (TraversalStatus.READY, TraversalStatus.RUNNING, TraversalStatus.PAUSED)
_ABLE: Final = (TraversalStatus.RUNNING, TraversalStatus.PAUSED, TraversalStatus.DONE)


class SharedRobot:
    """See the module.

    Attributes:
        bus: Its own.
        truth: What it has told of that, on its errand.
        status: What it told last of its errand.
        report, area: Of its errand, once that is over; the latter if a covering tool has worked on areas.
        finished: Whether it has come to the end of its errand.
        furthest_m: That it has reported.
        until_m: How far it was told that it may drive.
        limit_m: No further than this, whatever the traffic rules say.
        out: Why it is out of service; "" while it is not.
        out_at: Since when, wall clock (monotonic).
        lost: Whether its process is gone: one that comes back has no part in this job.
        gone: Whether it was carried away since.
        errand: What it is to do, as long as that is not put aside.
        stretch: Of its path, that it has for itself.
        strokes, reports, areas, works: Of errands that were put aside.
        ended_s: When the last of these ended, on the clock that all robots share.
    """

    def __init__(self, bus: Bus, vehicle: Vehicle, tell: Callable[[int, str], None]) -> None:
        """Listen, from before it is given anything to do; `tell` is told its events."""
        self.bus, self._tell, self._vehicle = bus, tell, vehicle
        self._told = bus.inbox([topics.EVENTS, topics.AREA_REPORT, topics.REPORT])
        self._latest = bus.inbox([topics.STATUS, topics.PAUSE_STATUS, topics.ODOMETRY], keep="latest")
        self.truth = ToldTruth(bus, vehicle)
        self._presence = bus.presence()
        self._take_over, self._remove = bus.serve(topics.TAKE_OVER), bus.serve(topics.REMOVE)
        self._said, self._place = SaidOfJob(), Odometry()
        self._paused_at, self._pause = math.inf, PauseStatus()
        self.status = TraversalStatus()
        self.report: TraversalReport | None = None
        self.area: AreaReport | None = None
        self.furthest_m, self.until_m, self.limit_m = 0.0, math.inf, math.inf
        self.finished = self._called_off = False
        self.out, self.out_at = "", 0.0
        self.lost = self.gone = False
        self.errand: Errand | None = None
        self.stretch = ClaimedStretch(bus.publisher(topics.CLAIMED).send)
        self.strokes: list[PaintMarks] = []
        self.reports: list[TraversalReport] = []
        self.areas: list[AreaReport] = []
        self.works: list[Work] = []
        self.ended_s = 0.0

    @property
    def name(self) -> str:
        """Its namespace."""
        return self.bus.namespace

    @property
    def done(self) -> bool:
        """Whether it has done what it was to do, and has said so."""
        return self.finished and self.report is not None

    @property
    def progress_m(self) -> float:
        """How far it has reported to be; infinite once it is done."""
        return math.inf if self.finished else self.furthest_m

    def claim(self) -> None:
        """While it is on its path, it has that for itself from where it has passed to how far it may drive."""
        if self.errand is None or self.finished or self._called_off:
            self.stretch.claim(*NOTHING)
        else:
            self.stretch.claim(self.furthest_m, min(self.until_m, self.errand.path.end_m))

    @property
    def rests(self) -> bool:
        """Whether it stands: held, paused, or with nothing to do."""
        held = self.status.state != TraversalStatus.RUNNING or self.until_m - self.furthest_m < _AT_M
        return held and abs(self.status.speed_mps) < RESTING_MPS

    @property
    def stands(self) -> bool:
        """Whether nothing else is to be heard of where it truly is: it does not drive, and all of that was heard."""
        driven = self.status.state != TraversalStatus.RUNNING and self.truth.time_s > self.time_s - _TRUTH_WITHIN_S
        return self.lost or driven

    @property
    def place(self) -> Standing:
        """Where it believes to be, or did when it was last heard."""
        return Standing(self.name, pose_of(self._place))

    @property
    def paused_since(self) -> float | None:
        """Since when (seconds since the epoch) it is paused by an operator; None if it is not."""
        return self._paused_at if math.isfinite(self._paused_at) and not self.out else None

    @property
    def painted(self) -> PaintBelief:
        """What it believes to have painted of its errand."""
        status = self.status
        return PaintBelief(status.painted_ids, status.painted_fraction.tolist(), status.coverage_pct)

    @property
    def told(self) -> list[ErrandStatus]:
        """How far it is with its errand, if it has one."""
        return [] if self.errand is None else [ErrandStatus(self.errand, self.painted, self.progress_m)]

    @property
    def time_s(self) -> float:
        """Sim time of its status, on its own clock."""
        return self.status.header.stamp.seconds

    @property
    def shared_s(self) -> float:
        """Sim time of its status, on the clock that all robots share."""
        return self.time_s + self.truth.ahead_s

    def listen(self) -> None:
        """Take what it has said since; what is older than its errand is not about that."""
        gone = any(each.node == topics.ROBOT_SIM and not each.alive for each in self._presence.poll())
        if not self.lost:
            self._hear()
        if gone and not self.lost:
            self.lost = True
            self.fail("its process is gone")

    def _hear(self) -> None:
        for _, message in self._told.messages():
            if isinstance(message, Event):
                self._tell(message.severity, f"{self.name}: {message.text}")
            elif isinstance(message, TraversalReport) and self._said.report(message):
                self.report = message
            elif isinstance(message, AreaReport) and self._said.report(message):
                self.area = message
        for _, message in self._latest.messages():
            if isinstance(message, Odometry):
                self._place = message
            elif isinstance(message, TraversalStatus) and self._is_of_errand(message):
                self.status, self.finished = message, self.finished or message.state == TraversalStatus.DONE
                if message.state == TraversalStatus.RUNNING:
                    self.truth.put_down()
                self.furthest_m = max(self.furthest_m, message.arc_length_m)
            elif isinstance(message, PauseStatus):
                self._pause = message
        waits = waits_for_operator(self.status, self._pause)
        self._paused_at = min(self._paused_at, time.time()) if waits else math.inf
        self.truth.listen()

    def _is_of_errand(self, status: TraversalStatus) -> bool:
        """Not what was told before it, nor what is told once it was cleared away."""
        cleared = self.errand is not None and status.state == TraversalStatus.IDLE
        return self._said.status(status) and not cleared

    def look(self) -> None:
        """Note whether it has failed, or, on the bus all the time, was set going again."""
        aborted = self.status.state == TraversalStatus.ABORTED and not self._called_off
        stopped = self.errand is not None and (aborted or self.status.state == TraversalStatus.ESTOPPED)
        if stopped and not self.out:
            self.fail(self.status.reason or "it has stopped")
        elif self.out and not self.lost and self.errand is not None and self.status.state in _ABLE:
            self.out = ""

    def call_off(self) -> None:
        """Have it give up its errand where it stands, which is no failure."""
        if self.status.state in _UNDER_WAY:
            self._called_off = True
            self.command(topics.ABORT)

    def fail(self, why: str) -> None:
        """It is out of service from now on."""
        self.out, self.out_at = why, time.monotonic()

    def orders(self) -> list[tuple[str, ServedCall[CommandRequest, CommandResponse]]]:
        """What operators have ordered concerning it, "take-over" or "remove"; each is to be answered."""
        found = list[tuple[str, ServedCall[CommandRequest, CommandResponse]]]()
        for kind, server in (("take-over", self._take_over), ("remove", self._remove)):
            while (call := server.poll()) is not None:
                found.append((kind, call))
        return found

    def ask(self, service: Service[Request, Response], request: Request, timeout_s: float = _CALL_S) -> Response | None:
        """Ask it something; None if its process is gone by then.

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
        """As `ask`, of a command without arguments."""
        self.ask(service, CommandRequest(request_id=fresh_id()))

    def set_speed(self, factor: float) -> None:
        """Sim seconds per wall second; 0 holds its clock."""
        self.ask(topics.SET_SPEED, SetSpeedRequest(request_id=fresh_id(), factor=factor))

    def authorize(self, until_m: float) -> None:
        """Let it drive so far, if it was not told so before."""
        if until_m != self.until_m:
            self.ask(topics.AUTHORIZE, AuthorizeRequest(request_id=fresh_id(), until_m=until_m))
            self.until_m = until_m

    def touch(self) -> None:
        """Have its bumper pressed."""
        request = InjectFaultRequest(request_id=fresh_id(), fault_json=PRESSED.model_dump_json())
        with suppress(JobFailed, CallError):  # the contact is told and counted whether or not it stops
            self.ask(topics.INJECT_FAULT, request)

    def keep_out(self) -> None:
        """Let it drive no further on its errand, should it be set going again: others do the rest of that."""
        with suppress(JobFailed):  # it may have been given up already
            self.authorize(0.0)

    def take(self, errand: Errand, begun_s: float, *, here: bool) -> None:
        """Load something to do; what was told until now is about something else.

        Args:
            errand: It.
            begun_s: When it is begun on, on a clock that all robots share.
            here: Whether it begins where it stands; else it is carried there.

        Raises:
            JobFailed: It refuses for longer than it takes to come to rest, or does not say that it is ready.
        """
        if not here:
            self.truth.carry()
        self._said.forget()
        self.report, self.area, self._called_off = None, None, False
        self.status, self.furthest_m, self.finished = TraversalStatus(), 0.0, False
        self.until_m = self.limit_m = math.inf
        trajectory, text = errand.plan.trajectory, errand.share.to_json()
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
        self.errand = errand
        while not (self._said.begun or self.lost):
            if time.monotonic() > deadline:
                raise JobFailed(f"robot {self.name} has taken its part, but does not say that it is ready")
            self.listen()
            time.sleep(_LOOK_S)
        if self._said.begun:
            self.truth.begin(self._said.since_s, begun_s)
        self.stretch.take(trajectory.path.segments, self._vehicle)

    def conclude(self) -> None:
        """Put its errand aside, and what was painted on it.

        A process that is gone cannot be asked what it has painted: then it is what was heard.
        """
        if self.errand is None:
            return
        told = self.ask(topics.GET_PAINT, GetPaintRequest(), 30.0)
        strokes = self.truth.strokes() if told is None else told.strokes
        self.works.append(self.truth.work(self.errand.share, strokes))
        self.strokes += strokes
        if self.report is not None:
            self.reports.append(self.report)
            self.ended_s = max(self.ended_s, self.report.header.stamp.seconds + self.truth.ahead_s)
        if self.area is not None:
            self.areas.append(self.area)
        self.errand = None


class _Lost(CallError):
    """The process that was asked is gone."""


def fresh_id() -> str:
    """Of a request."""
    return uuid.uuid4().hex
