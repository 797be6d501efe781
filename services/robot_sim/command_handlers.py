"""Services of the robot for operators: every request is answered with success or a clear reason."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any, Final, NamedTuple

from touchline.onboard.interface import OnboardEvent
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.catalogue import parse_template
from touchline.schemas.cdr import encode
from touchline.schemas.errors import CommandRefused, TouchlineError
from touchline.schemas.faults import describe, parse_fault
from touchline.schemas.messages.base import Message
from touchline.schemas.placement import same_place
from touchline.schemas.plan_cause import PlanCause
from touchline.schemas.spec import parse
from touchline.schemas.template import Template
from touchline.schemas.topics import Service
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.guided_warm_up import warm_up_guided
from touchline.services.robot_sim.journal import Journal, digest
from touchline.services.robot_sim.journal_keeper import JournalKeeper, Taken
from touchline.services.robot_sim.loaded_job import LoadedJob, Taking
from touchline.services.robot_sim.packing import Payload, header, job_payloads
from touchline.services.robot_sim.telemetry import Telemetry

Handler = Callable[[Any], Message]
FASTEST: Final = 1000.0
"""Largest speed factor; a negative one has no limit."""
_KNOWN_S: Final = 1.0
"""Wall time after which the processes on the bus are known."""
_LOOK_S: Final = 0.02
LOCKSTEP_MOST_S: Final = 10.0
"""Longest time between two answers that a guided robot waits for."""
REPLACING_BYTES: Final = 256 * 1024
"""Size limit of a load that takes over under way, because it is read while the robot drives."""


_TAKEN: Final = {
    Taking.CARRIED: "loaded",
    Taking.HERE: "loaded where the robot stands",
    Taking.UNDER_WAY: "took over under way",
}


class Ready(NamedTuple):
    """Trajectory that can be taken at once.

    Attributes:
        job: Prepared job of the emulator.
        taken: Entry for the journal.
        payloads: Payloads to publish about it.
        trajectory: The trajectory.
        template: Its template, if there is one.
    """

    job: LoadedJob
    taken: Taken
    payloads: list[Payload]
    trajectory: m.Trajectory
    template: Template | None


class Load(NamedTuple):
    """Handler of a service whose request needs time: `prepare` in any thread; `take` between ticks, or `refuse`.

    `take` returns the answer; None if it is still to come.
    """

    prepare: Callable[[Any], Any]
    take: Callable[[Any], Message | None]
    refuse: Callable[[str], Message]


class Guiding(NamedTuple):
    """Link to coordinators.

    Attributes:
        knows: Returns True if a session is on the bus as a coordinator; in any thread.
        begun: Called with the session that guides the robot from now on, and the interval at which the robot waits for
            its answer (s).
        set_owner: Answers a coordinator that takes over from another one.
    """

    knows: Callable[[str], bool]
    begun: Callable[[str, float], None]
    set_owner: Callable[[m.SetOwnerRequest], m.SetOwnerResponse]


NOBODY_GUIDES: Final = Guiding(
    lambda session: False,
    lambda session, lockstep_s: None,
    lambda request: m.SetOwnerResponse(message="the robot is not on a bus"),
)


class Commands:
    """Handlers of all services of the robot, applied between ticks.

    Args:
        emulator: The robot.
        telemetry: Its telemetry.
        set_speed: Called with a new, checked speed factor.
        journal: Journal of the progress, for a process that comes after this one.
        guiding: Link to coordinators.

    Attributes:
        handlers: Per service, the function from request to response.
        loads: Handlers of services that take a trajectory, which needs time to be read and checked.
        outgoing: Payloads to publish, which the caller takes.
        trajectory: Trajectory that was taken last.
        taken: Called after a load was taken.
    """

    def __init__(
        self,
        emulator: Emulator,
        telemetry: Telemetry,
        set_speed: Callable[[float], None],
        journal: Journal | None = None,
        guiding: Guiding = NOBODY_GUIDES,
    ) -> None:
        self._progress = JournalKeeper(emulator, journal)
        self._guiding = guiding
        self._emulator, self._telemetry, self._set_speed = emulator, telemetry, set_speed
        self.trajectory = m.Trajectory()
        self.taken: Callable[[Ready], None] = lambda ready: None
        self.outgoing: list[Payload] = telemetry.news() if self._progress.restore_latch() else []
        self._unfinished = self._progress.unfinished
        if journal is not None:
            self.outgoing.append((topics.UNFINISHED, encode(self._unfinished)))
        self.handlers: dict[Service[Any, Any], Handler] = {
            topics.SET_SPEED: self.set_speed,
            topics.AUTHORIZE: self.authorize,
            topics.SET_OWNER: guiding.set_owner,
            topics.INJECT_FAULT: self.inject_fault,
            topics.START: self._plain(emulator.start),
            topics.PAUSE: self.pause,
            topics.RESUME: self._plain(emulator.resume),
            topics.ABORT: self._plain(emulator.abort),
            topics.ESTOP: self._plain(emulator.estop),
            topics.RESET: self._plain(emulator.reset),
            topics.REFILL_TANK: self._supply(emulator.refill_tank, "tank-refilled", "the tank was refilled", "l"),
            topics.REPLACE_BATTERY: self._supply(
                emulator.replace_battery, "battery-replaced", "the battery was replaced", "Wh"
            ),
        }
        self.loads: dict[Service[Any, Any], Load] = {
            topics.LOAD: Load(self.prepare_load, self.load, self.refuse_load),
            topics.START_TRAVERSAL: Load(self.prepare_start, self.start_traversal, self.refuse_start),
            topics.BEGIN_GUIDED: Load(self.prepare_guided, self.begin_guided, self.refuse_guided),
        }

    def check_load(self, size_bytes: int) -> str:
        """Return the reason why a load of this size would be refused now, whatever it is; "" if there is none."""
        if self._emulator.onboard.state == m.TraversalStatus.RUNNING and size_bytes <= REPLACING_BYTES:
            return ""
        try:
            self._emulator.check_load()
        except CommandRefused as error:
            return str(error)
        return ""

    def prepare_load(self, request: m.LoadRequest) -> Ready:
        """Read and check a trajectory and, if given, the template to evaluate the paint by; in any thread.

        Raises:
            CommandRefused, SpecError: It cannot be driven, or not be resumed, or contradicts itself.
        """
        if request.resume + request.here + request.replace > 1:
            raise CommandRefused("resume, here and replace exclude each other: give one of them")
        if request.resume and not request.trajectory.path.segments:
            request = self._progress.kept_job().model_copy(update={"resume": True})
        template = parse_template(request.template_json) if request.template_json.strip() else None
        if template is not None:
            self._check_origin(template)
        resume, earlier = self._progress.to_resume(request.trajectory) if request.resume else (None, None)
        taking = Taking.HERE if request.here else Taking.UNDER_WAY if request.replace else Taking.CARRIED
        cause = parse(PlanCause, request.cause_json, "cause_json") if request.cause_json else None
        job = self._emulator.prepare(request.trajectory, template, resume, earlier, taking, cause)
        taken = Taken(
            digest(request.trajectory),
            encode(request),
            template.name if template is not None else "",
            works=bool(job.ledger.ids) or job.account is not None,
            resumed=request.resume,
        )
        return Ready(job, taken, job_payloads(request.trajectory, template), request.trajectory, template)

    def prepare_start(self, request: m.StartTraversalRequest) -> Ready:
        """Prepare a trajectory alone, as `prepare_load`."""
        return self.prepare_load(m.LoadRequest(trajectory=request.trajectory))

    def load(self, ready: Ready) -> m.LoadResponse:
        """Take a prepared load and return the answer."""
        try:
            total_time_s = self.take_job(ready)
        except CommandRefused as error:
            return self.refuse_load(str(error))
        resume, earlier = ready.job.resume, ready.job.earlier
        message = _TAKEN[ready.job.taking] if resume is None else f"loaded, to go on at {resume.arc_length_m:.2f} m"
        if earlier is not None and (lost := earlier.totals.points - len(earlier.paint)):
            lack = f"{lost} of {earlier.totals.points} points of the paint so far are missing in all figures"
            self.outgoing += self._of_journal(lack)
            message += f"; {lack}"
        return m.LoadResponse(success=True, message=message, total_time=total_time_s)

    def take_job(self, ready: Ready) -> float:
        """Take a prepared trajectory; return its planned duration [s].

        Raises:
            CommandRefused: Not now, or not here.
        """
        job = ready.job
        if job.earlier is not None:
            job = job._replace(earlier=self._progress.as_of_now(job.earlier))
        total_time_s = self._emulator.take(job)
        self.trajectory = ready.trajectory
        self.outgoing += self._telemetry.awake() + self._telemetry.begin(ready.payloads)
        if job.earlier is not None:
            self.outgoing += self._telemetry.restored_paint()
        self.outgoing += self._of_journal(self._progress.loaded(ready.taken))
        self.taken(ready)
        return total_time_s

    @property
    def concluded(self) -> bool:
        """True unless the report of an ended traversal is still being made: nothing is loaded before."""
        return self._telemetry.ended is None

    def refuse_load(self, reason: str) -> m.LoadResponse:
        """Return the answer to a refused load."""
        return m.LoadResponse(success=False, message=reason)

    def _check_origin(self, template: Template) -> None:
        """Refuse a drawing in another map frame, which would be painted in the wrong place."""
        here, there = self._emulator.scenario.origin, template.origin
        if there is not None and not same_place(there, here):
            text = f"{there.latitude_deg:.8f},{there.longitude_deg:.8f}"
            own = f"{here.latitude_deg!r},{here.longitude_deg!r},{here.altitude_m!r}"
            raise CommandRefused(
                f"the template's origin {text} is not the robot's: carry it over with "
                f"`touchline templates FILE --map-origin {own}` and plan again"
            )

    def start_traversal(self, ready: Ready) -> m.StartTraversalResponse:
        """Load and start in one, as the robot's own service does."""
        try:
            total_time_s = self.take_job(ready)
            self._emulator.start()
        except CommandRefused as error:
            return self.refuse_start(str(error))
        self.report_changes()
        return m.StartTraversalResponse(total_time=total_time_s, success=True)

    def refuse_start(self, reason: str) -> m.StartTraversalResponse:
        """Return the answer to a refused start; it has no field for the reason, which goes to the event log."""
        self.report(m.Event.ERROR, "start-refused", reason)
        return m.StartTraversalResponse(total_time=0.0, success=False)

    def prepare_guided(self, request: m.BeginGuidedRequest) -> m.BeginGuidedRequest:
        """Check a request, and compile the kernels of guided driving.

        Raises:
            CommandRefused: It is out of range, or its coordinator is not on the bus.
        """
        until_s = time.monotonic() + _KNOWN_S
        while not self._guiding.knows(request.coordinator):
            if time.monotonic() > until_s:
                who = f'the session "{request.coordinator}", which is not on the bus as a coordinator'
                raise CommandRefused(f"is to be guided by {who}; give the id of the coordinator's own session")
            time.sleep(_LOOK_S)
        if not (math.isfinite(request.lockstep_s) and 0.0 <= request.lockstep_s <= LOCKSTEP_MOST_S):
            raise CommandRefused(f"lockstep_s is {request.lockstep_s}; give 0, or up to {LOCKSTEP_MOST_S:g} s")
        if not (math.isfinite(request.margin_m) and request.margin_m >= 0.0):
            raise CommandRefused(f"margin_m is {request.margin_m}; give the distance by which it may be off, or 0: any")
        warm_up_guided(self._emulator.setup)
        return request

    def begin_guided(self, request: m.BeginGuidedRequest) -> m.BeginGuidedResponse:
        """Follow a coordinator's guidance from now on."""
        try:
            self._emulator.begin_guided(plans=request.plans, margin_m=request.margin_m)
        except CommandRefused as error:
            return self.refuse_guided(str(error))
        self.trajectory = m.Trajectory()
        self.outgoing += self._telemetry.begin([])
        self._guiding.begun(request.coordinator, request.lockstep_s)
        return m.BeginGuidedResponse(success=True, message="guided")

    def refuse_guided(self, reason: str) -> m.BeginGuidedResponse:
        """Return the answer to a refused request."""
        return m.BeginGuidedResponse(success=False, message=reason)

    def note_progress(self) -> list[Payload]:
        """Update the journal, after every tick or every few, but before the paint of these is published.

        Returns:
            Payloads to publish about the journal; empty if all is well.
        """
        news = self._of_journal(self._progress.note_latch()) + self._of_journal(self._progress.note())
        if (unfinished := self._progress.unfinished) is not self._unfinished:
            self._unfinished = unfinished
            news.append((topics.UNFINISHED, encode(unfinished)))
        return news

    def _of_journal(self, problem: str) -> list[Payload]:
        """Make an event about the journal; it concerns this machine's disk, so it is not in the session's hash."""
        if not problem:
            return []
        head = header(self._emulator.tick_count)
        event = m.Event(header=head, severity=m.Event.WARN, source=topics.ROBOT_SIM, code="journal", text=problem)
        return [(topics.EVENTS, encode(event))]

    def set_speed(self, request: m.SetSpeedRequest) -> m.SetSpeedResponse:
        """Change the pace of sim time."""
        if not math.isfinite(request.factor) or request.factor > FASTEST:
            reason = f"factor is {request.factor}; give 0 to hold, up to {FASTEST:.0f}, or a negative for no limit"
            return m.SetSpeedResponse(success=False, message=reason)
        self._set_speed(request.factor)
        return m.SetSpeedResponse(success=True, message="speed set")

    def authorize(self, request: m.AuthorizeRequest) -> m.AuthorizeResponse:
        """Allow the robot to drive up to an arc length."""
        if math.isnan(request.until_m):
            return m.AuthorizeResponse(success=False, message="until_m is nan; give an arc length in m, or inf")
        try:
            self._emulator.authorize(request.until_m)
        except CommandRefused as error:
            return m.AuthorizeResponse(success=False, message=str(error))
        return m.AuthorizeResponse(success=True, message="done")

    def inject_fault(self, request: m.InjectFaultRequest) -> m.InjectFaultResponse:
        """Inject a fault, from the next tick on unless it has a later start."""
        try:
            fault = parse_fault(request.fault_json)
            self._emulator.inject_fault(fault)
        except TouchlineError as error:
            return m.InjectFaultResponse(success=False, message=str(error))
        self.outgoing += self._telemetry.news()
        return m.InjectFaultResponse(success=True, message=describe(fault))

    def pause(self, request: m.CommandRequest) -> m.CommandResponse:
        """Brake; succeed if the robot is already paused for good."""
        response = self._plain(self._emulator.pause)(request)
        if not response.success and self._emulator.onboard.state == m.TraversalStatus.PAUSED:
            return m.CommandResponse(success=True, message="already paused")
        return response

    def fail_safe(self, missed_s: float) -> None:
        """Pause after the loop has missed its turns for so long that the actuators have stopped by themselves."""
        self._emulator.fail_safe(missed_s)
        reason = f"the control loop did not turn for {missed_s:.2f} s: valve shut and wheels braked; resume to go on"
        self.report(m.Event.ERROR, "watchdog", reason)
        self.outgoing += self._telemetry.news()

    def link_lost(self) -> None:
        """Pause because no operator who could stop the robot is on the bus any more."""
        self._emulator.link_lost()
        self.report(m.Event.ERROR, "link-lost", "no operator and no planner on the bus: the robot pauses, valve closed")
        self.outgoing += self._telemetry.news()

    def shut_down(self) -> None:
        """Pause because the process is to end while the robot drives."""
        self._emulator.shut_down()
        self.report(m.Event.WARN, "shut-down", "the robot is switched off: it brakes with the valve closed")
        self.outgoing += self._telemetry.news()

    def report(self, severity: int, code: str, text: str) -> None:
        """Add a line to the event log: severity as in `Event`, machine-readable kind, and text for people."""
        self.outgoing.append(self._telemetry.report_event(OnboardEvent(severity, code, text)))

    def report_changes(self) -> None:
        """Publish the changes made by a command."""
        self.outgoing += self._telemetry.news()

    def take(self) -> list[Payload]:
        """Return and clear the payloads to publish."""
        outgoing, self.outgoing = self.outgoing, []
        return outgoing

    def _supply(self, command: Callable[[], tuple[float, float]], code: str, what: str, unit: str) -> Handler:
        def handle(_request: m.CommandRequest) -> m.CommandResponse:
            try:
                before, after = command()
            except CommandRefused as error:
                return m.CommandResponse(success=False, message=str(error))
            text = f"{what}: {before:.2f} {unit} before, {after:.2f} {unit} now"
            self.report(m.Event.INFO, code, text)
            self.outgoing += self._telemetry.supplies() + self.note_progress()
            return m.CommandResponse(success=True, message=text)

        return handle

    def _plain(self, command: Callable[[], None]) -> Callable[[m.CommandRequest], m.CommandResponse]:
        def handle(_request: m.CommandRequest) -> m.CommandResponse:
            try:
                command()
            except CommandRefused as error:
                return m.CommandResponse(success=False, message=str(error))
            warning = self._progress.note_latch()  # before anybody is informed that the robot is stopped, or released
            self.outgoing += self._telemetry.news()
            self.outgoing += self._of_journal(warning)
            return m.CommandResponse(success=True, message=f"done, but {warning}" if warning else "done")

        return handle
