"""The bridge as a process: records its robots on request, and shows them to ROS 2."""

import gc
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path

from touchline.schemas import topics
from touchline.schemas.messages import (
    DiagnosticStatus,
    Event,
    Header,
    RecordRequest,
    RecordResponse,
    RecordStopResponse,
    Time,
)
from touchline.services.bridge.folder import RecordingFolder
from touchline.services.bridge.gateway import Gateway, GatewayConfig, passing_stops
from touchline.services.bridge.going import GoingRecording, next_part
from touchline.services.bridge.handshake import shake_hands
from touchline.services.bridge.output import RecordingError
from touchline.services.bridge.recorder import Existing, Recorder, RecordingReport
from touchline.services.bridge.session import MOST_ROUNDS, RecordingSession
from touchline.services.bus import Bus, BusConfig, HealthReporter
from touchline.services.bus.ros2 import Ros2Session
from touchline.services.system.priority import switch_threads_soon
from touchline.services.system.shutdown import Stop, until_stopped

_IDLE_S = 0.002
_HANDSHAKE_TIMEOUT_S = 3.0
#: Processes that publish what is recorded, and that can be asked how they are.
_PUBLISHERS = frozenset({topics.PLANNER, topics.TELEMETRY})


class BridgeService:
    """Serves recording; everything happens in :meth:`run`'s one loop.

    Args:
        buses: Of each robot.
        existing: What to do when a recording's file is there already.
        recordings: The folder of what is recorded on request.
        gateways: To ROS 2, one for each robot, if it is to see them.
        beat: Called in waits that are longer than a turn of the loop, to show that it is at work.
        going: Where to note what is being recorded, for a bridge after this one.
    """

    def __init__(
        self,
        buses: Sequence[Bus],
        existing: Existing,
        recordings: RecordingFolder,
        gateways: Sequence[Gateway] = (),
        beat: Callable[[], None] = lambda: None,
        going: GoingRecording | None = None,
    ) -> None:
        self._ends = [_RobotEnd(bus) for bus in buses]
        self._going = going
        self._parts: list[Path] = []
        self._folder = recordings
        self._beat = beat
        self._gateways = gateways
        self._existing = existing
        self._session: RecordingSession | None = None
        self._failed: RecordingReport | None = None
        self._gaps_told = 0
        self._was_behind = False

    def run(self, stop: Stop) -> RecordingReport | None:
        """Serve until ``stop``; an active recording is then finished and its report returned."""
        while not stop:
            if not self._turn():
                time.sleep(_IDLE_S)
        return self._finish()

    def go_on(self) -> None:
        """Resume, in a new file, the recording of a previous bridge that was killed; report if that fails."""
        parts = self._going.left_behind() if self._going is not None else []
        if not parts:
            return
        path = next_part(parts)
        try:
            self.start(path, parts)
        except RecordingError as error:
            text = f"the bridge was ended while it recorded {parts[-1].name}, and cannot go on: {error}"
            for end in self._ends:
                end.publish(Event.ERROR, "recording-failed", text, 0)
            return
        text = (
            f"the bridge was ended while it recorded {parts[-1].name}; it goes on in {path.name}, "
            "what was sent in between is missing"
        )
        self._tell(Event.WARN, "recording-goes-on", text)

    def start(self, path: Path, continues: Sequence[Path] = ()) -> None:
        """Begin to record; on return every publisher on the bus knows of it.

        Args:
            path: The file.
            continues: The files of the same recording before this one.

        Raises:
            RecordingError: It goes on already, or the file cannot be created or written.
        """
        if self._session is not None:
            raise RecordingError(f"{self._session.recorder.path} is being recorded; stop that first")
        self._failed, self._gaps_told = None, 0
        namespaces = [end.bus.namespace for end in self._ends]
        recorder = Recorder(path, namespaces, topics.RECORDED, self._existing, continues)
        self._parts = [*continues, path]
        if self._going is not None:
            self._going.note(self._parts)
        self._session = RecordingSession(recorder, [end.bus.inbox(topics.RECORDED) for end in self._ends])
        self._handshake()
        if self._failed is not None:
            raise RecordingError(self._failed.problem)

    def _turn(self) -> bool:
        """One round of the loop; returns whether there was anything to record."""
        for end in self._ends:
            end.presence.poll()
        busy = self._pump()
        for gateway in self._gateways:
            busy |= gateway.turn()
        self._tell_problems()
        self._report_health()
        for end in self._ends:
            if (call := end.record.poll()) is not None:
                call.reply(self._answer_record(call.request))
            if (stop_call := end.record_stop.poll()) is not None:
                stop_call.reply(self._answer_stop())
        return busy

    def _tell_problems(self) -> None:
        """Publish what ROS 2 nodes have asked for in vain, each under its robot."""
        for end, gateway in zip(self._ends, self._gateways, strict=False):
            for problem in gateway.take_problems():
                recorder = self._session.recorder if self._session is not None else None
                time_ns = recorder.now_ns(end.bus.namespace) if recorder is not None else 0
                end.publish(Event.ERROR, "goal-refused", problem, time_ns)

    def _pump(self) -> bool:
        if self._session is None:
            return False
        try:
            busy = self._session.pump(time.monotonic())
        except RecordingError as error:
            self._fail(error)
            return False
        if self._session.recorder.gaps > self._gaps_told:
            self._gaps_told = self._session.recorder.gaps
            text = f"the recording lacks {self._session.recorder.lost} messages so far; its metadata say where"
            self._tell(Event.WARN, "recording-fell-behind", text)
        return busy

    def _tell(self, severity: int, code: str, text: str) -> None:
        """Publish an event under every robot, at its sim time in the recording."""
        assert self._session is not None
        for end in self._ends:
            end.publish(severity, code, text, self._session.recorder.now_ns(end.bus.namespace))

    def _fail(self, error: RecordingError) -> None:
        """End a recording that cannot be written; leaving the bus's topics lets their publishers go on."""
        assert self._session is not None
        self._failed = self._session.finish()
        self._tell(Event.ERROR, "recording-failed", self._failed.problem or str(error))
        self._ended()

    def _ended(self) -> None:
        self._session = None
        if self._going is not None:
            self._going.forget()

    def _report_health(self) -> None:
        level, message, values = self._health()
        for number, end in enumerate(self._ends):
            figures = self._gateways[number].figures() if self._gateways else {}
            end.health.poll({**values, **figures}, level=level, message=message)

    def _health(self) -> tuple[int, str, dict[str, object]]:
        """(level, message, figures) of the recording."""
        if self._failed is not None:
            return DiagnosticStatus.ERROR, self._failed.problem, {"recording": ""}
        if self._session is None:
            return DiagnosticStatus.OK, "idle", {"recording": ""}
        recorder = self._session.recorder
        values: dict[str, object] = {
            "recording": recorder.path,
            "messages": recorder.messages,
            "bytes": recorder.size_bytes,
            "lost_in_recording": recorder.lost,
            "rejected_in_recording": self._session.rejected,
        }
        flawed = recorder.lost or self._session.rejected
        return DiagnosticStatus.WARN if flawed else DiagnosticStatus.OK, "recording", values

    def _answer_record(self, request: RecordRequest) -> RecordResponse:
        try:
            path = self._folder.place(request.path)
            self.start(path)
        except RecordingError as error:
            return RecordResponse(success=False, message=str(error))
        return RecordResponse(success=True, message=f"recording to {path}")

    def _answer_stop(self) -> RecordStopResponse:
        report = self._finish() if self._session is not None else self._failed
        self._failed = None
        if report is None:
            return RecordStopResponse(success=False, message="nothing is being recorded")
        return RecordStopResponse(
            success=not report.problem,
            message=report.problem or _in_words(report, self._parts),
            path=str(report.path),
            messages=report.messages,
            bytes=report.bytes,
            lost=report.lost,
        )

    def _finish(self) -> RecordingReport | None:
        """Finish the recording with everything that was sent before this call."""
        if self._session is not None:
            self._handshake()
            self._catch_up()
        if self._session is None:  # there was none, or writing its last part failed
            return self._failed
        report = self._session.finish()
        self._ended()
        return report

    def _handshake(self) -> None:
        """Know that every publisher knows of us and that what it has sent is here, recording meanwhile.

        An answer comes behind all that was sent before: who has not answered in time while that was more than could be
        recorded is asked again.
        """
        for end in self._ends:
            answered = False
            while not answered:
                self._was_behind = False
                answered = shake_hands(end.bus, end.presence, _PUBLISHERS, _HANDSHAKE_TIMEOUT_S, self._while_waiting)
                answered |= not self._was_behind

    def _catch_up(self) -> None:
        """Record what has arrived by now; publishers may go on for ever."""
        for _ in range(MOST_ROUNDS):
            if self._session is None or not self._session.behind:
                break
            self._while_waiting()

    def _while_waiting(self) -> None:
        self._beat()
        self._pump()
        self._was_behind |= self._session is not None and self._session.behind
        for gateway in self._gateways:
            gateway.turn()
        self._report_health()


class _RobotEnd:
    """The bridge's end of one robot's bus: asked by any of them, it records all."""

    def __init__(self, bus: Bus) -> None:
        self.bus = bus
        self.presence = bus.presence()
        self.health = HealthReporter(bus)
        self.record = bus.serve(topics.RECORD)
        self.record_stop = bus.serve(topics.RECORD_STOP)
        self._events = bus.publisher(topics.EVENTS)

    def publish(self, severity: int, code: str, text: str, time_ns: int) -> None:
        """An event for this robot's log."""
        header = Header(stamp=Time.of_ns(time_ns))
        self._events.send(Event(header=header, severity=severity, source=topics.BRIDGE, code=code, text=text))


def _in_words(report: RecordingReport, parts: Sequence[Path]) -> str:
    text = f"recorded {report.messages} messages"
    if len(parts) > 1:
        text += f" in {parts[-1].name}, after {', '.join(part.name for part in parts[:-1])}, where the bridge was ended"
    if report.lost:
        text += f"; {report.lost} were lost on the way"
    if report.rejected:
        text += f"; {report.rejected} payloads were no messages of their topic and are left out"
    return text


def run_service(
    record: Path | None = None,
    config: BusConfig | None = None,
    *,
    recordings: Path | None = None,
    existing: Existing = Existing.RENAME,
    ros2: GatewayConfig | None = None,
    supervisor: int | None = None,
) -> RecordingReport | None:
    """Run the bridge until SIGTERM or SIGINT.

    Args:
        record: Begin at once to record to this file, wherever it is.
        config: Where the bus is; from the environment if not given.
        recordings: The folder of what is recorded on request; by default the present one.
        existing: What to do when a recording's file is there already.
        ros2: Be a gateway to ROS 2, too.
        supervisor: Process id of the parent, to end with it.

    Returns:
        The report of the recording that went on at the end, if any.

    Raises:
        RecordingError: ``record`` cannot be created, or there is no folder ``recordings``.
        SpecError: The bus configuration cannot be used.
        TouchlineError: Another bridge is there, or ROS 2 nodes cannot be met where ``ros2`` says.
    """
    folder = RecordingFolder(recordings or Path.cwd())
    config = config or BusConfig.from_environment()
    switch_threads_soon()
    with (
        until_stopped(supervisor) as stop,
        Bus.open_all(topics.BRIDGE, config, lambda: stop.asked) as buses,
        ExitStack() as stack,
    ):
        for bus in buses:
            bus.claim()
        gateways = []
        if ros2 is not None:
            session = stack.enter_context(Ros2Session.open(ros2.endpoint))
            for number, bus in enumerate(buses):
                alone = len(buses) == 1
                gateways.append(Gateway(bus, session, ros2.of(bus.namespace, alone=alone), number, alone=alone))
            stack.enter_context(passing_stops(gateways))
        going = GoingRecording(config, folder.path, supervisor)
        service = BridgeService(buses, existing, folder, gateways, stop.beat, going)
        gc.freeze()  # a collection of all that was loaded would hold up stops from ROS 2
        if record is not None:
            service.start(record)
        else:
            service.go_on()
        return service.run(stop)
