"""What operators can ask of the robot: every request answered with success or a clear reason."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

from schemas import messages as m
from schemas import topics
from schemas.catalogue import parse_template
from schemas.cdr import encode
from schemas.errors import CommandRefused, SpecError
from schemas.faults import describe, parse_fault
from schemas.messages.base import Message
from schemas.placement import same_place
from schemas.template import Template
from schemas.topics import Service
from services.robot_sim.emulator import Emulator
from services.robot_sim.frames import OnboardEvent
from services.robot_sim.journal import Journal
from services.robot_sim.packing import Payload, header
from services.robot_sim.progress import Progress
from services.robot_sim.telemetry import Telemetry

Handler = Callable[[Any], Message]
FASTEST: Final = 1000.0
"""Largest factor that can be asked for; beyond it, ask for as fast as it goes."""


class Commands:
    """The handlers of all services of the robot, applied between ticks.

    Args:
        emulator: The robot.
        telemetry: Its voice.
        set_speed: Called with a new, checked speed factor.
        journal: Where progress is kept for a process that comes after this one.

    Attributes:
        handlers: Per service, the function from request to response.
        told: Payloads to publish, which the caller takes away.
    """

    def __init__(
        self,
        emulator: Emulator,
        telemetry: Telemetry,
        set_speed: Callable[[float], None],
        journal: Journal | None = None,
    ) -> None:
        self._progress = Progress(emulator, journal)
        self._emulator, self._telemetry, self._set_speed = emulator, telemetry, set_speed
        self.told: list[Payload] = telemetry.news() if self._progress.restore_latch() else []
        self.handlers: dict[Service[Any, Any], Handler] = {
            topics.LOAD: self.load,
            topics.START_TRAVERSAL: self.start_traversal,
            topics.SET_SPEED: self.set_speed,
            topics.INJECT_FAULT: self.inject_fault,
            topics.GET_PAINT: lambda _request: telemetry.strokes(),
            topics.START: self._plain(emulator.start),
            topics.PAUSE: self._plain(emulator.pause),
            topics.RESUME: self._plain(emulator.resume),
            topics.ABORT: self._plain(emulator.abort),
            topics.ESTOP: self._plain(emulator.estop),
            topics.RESET: self._plain(emulator.reset),
            topics.REFILL_TANK: self._supply(emulator.refill_tank, "tank-refilled", "the tank was refilled", "l"),
            topics.REPLACE_BATTERY: self._supply(
                emulator.replace_battery, "battery-replaced", "the battery was replaced", "Wh"
            ),
        }

    def load(self, request: m.LoadRequest) -> m.LoadResponse:
        """Take a trajectory and, if given, the template to judge the paint by."""
        try:
            template = parse_template(request.template_json) if request.template_json.strip() else None
            if template is not None:
                self._check_origin(template)
            resume, remains = self._progress.unfinished(request.trajectory) if request.resume else (None, None)
            total_time_s = self._emulator.load(request.trajectory, template, resume, remains)
        except (CommandRefused, SpecError) as error:
            return m.LoadResponse(success=False, message=str(error))
        self.told += self._telemetry.loaded(request.trajectory, template)
        self.told += self._of_journal(self._progress.loaded(request.trajectory, resumed=request.resume))
        message = "loaded" if resume is None else f"loaded, to go on at {resume.arc_length_m:.2f} m"
        if remains is not None and (lost := remains.totals.points - len(remains.paint)):
            lack = f"{lost} of {remains.totals.points} points of the paint so far are missing in all figures"
            self.told += self._of_journal(lack)
            message += f"; {lack}"
        return m.LoadResponse(success=True, message=message, total_time=total_time_s)

    def _check_origin(self, template: Template) -> None:
        """A drawing in another map frame would be painted in the wrong place."""
        here, there = self._emulator.scenario.origin, template.origin
        if there is not None and not same_place(there, here):
            text = f"{there.latitude_deg:.8f},{there.longitude_deg:.8f}"
            own = f"{here.latitude_deg!r},{here.longitude_deg!r},{here.altitude_m!r}"
            raise CommandRefused(
                f"the template's origin {text} is not the robot's: carry it over with "
                f"`touchline templates FILE --map-origin {own}` and plan again"
            )

    def start_traversal(self, request: m.StartTraversalRequest) -> m.StartTraversalResponse:
        """Load and start in one, as the robot's own service does; a refusal's reason goes to the event log."""
        try:
            total_time_s = self._emulator.load(request.trajectory)
            self.told += self._telemetry.loaded(request.trajectory, None)
            self.told += self._of_journal(self._progress.loaded(request.trajectory, resumed=False))
            self._emulator.start()
        except CommandRefused as error:
            self.tell(m.Event.ERROR, "start-refused", str(error))
            return m.StartTraversalResponse(total_time=0.0, success=False)
        self.told += self._telemetry.news()
        return m.StartTraversalResponse(total_time=total_time_s, success=True)

    def note_progress(self) -> list[Payload]:
        """Keep the journal, after every tick or every few, but before the paint of these is published.

        Returns what is to be published about that: nothing, if all is well.
        """
        return self._of_journal(self._progress.note_latch()) + self._of_journal(self._progress.note())

    def _of_journal(self, problem: str) -> list[Payload]:
        """A line of the event log; it is about this machine's disk, so it has no part in the session's hash."""
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

    def inject_fault(self, request: m.InjectFaultRequest) -> m.InjectFaultResponse:
        """Let something go wrong; from the next tick on unless it says later."""
        try:
            fault = parse_fault(request.fault_json)
            self._emulator.inject_fault(fault)
        except (CommandRefused, SpecError) as error:
            return m.InjectFaultResponse(success=False, message=str(error))
        self.told += self._telemetry.news()
        return m.InjectFaultResponse(success=True, message=describe(fault))

    def link_lost(self) -> None:
        """Nobody who could stop the robot is there any more."""
        self._emulator.link_lost()
        self.tell(m.Event.ERROR, "link-lost", "no operator and no planner on the bus: the robot pauses, valve closed")
        self.told += self._telemetry.news()

    def shut_down(self) -> None:
        """The process is to end while the robot drives."""
        self._emulator.pause()
        self.tell(m.Event.WARN, "shut-down", "the robot is switched off: it brakes with the valve closed")
        self.told += self._telemetry.news()

    def tell(self, severity: int, code: str, text: str) -> None:
        """Add a line to the event log."""
        self.told.append(self._telemetry.tell(OnboardEvent(severity, code, text)))

    def take(self) -> list[Payload]:
        """The payloads to publish since the last call."""
        told, self.told = self.told, []
        return told

    def _supply(self, command: Callable[[], tuple[float, float]], code: str, what: str, unit: str) -> Handler:
        def handle(_request: m.CommandRequest) -> m.CommandResponse:
            try:
                before, after = command()
            except CommandRefused as error:
                return m.CommandResponse(success=False, message=str(error))
            text = f"{what}: {before:.2f} {unit} before, {after:.2f} {unit} now"
            self.tell(m.Event.INFO, code, text)
            self.told += self.note_progress()
            return m.CommandResponse(success=True, message=text)

        return handle

    def _plain(self, command: Callable[[], None]) -> Handler:
        def handle(_request: m.CommandRequest) -> m.CommandResponse:
            try:
                command()
            except CommandRefused as error:
                return m.CommandResponse(success=False, message=str(error))
            warning = self._progress.note_latch()  # before anybody hears that the robot is stopped, or released
            self.told += self._telemetry.news()
            self.told += self._of_journal(warning)
            return m.CommandResponse(success=True, message=f"done, but {warning}" if warning else "done")

        return handle
