"""Loop of the bridge: records its robots on request, and connects them with ROS 2 and viewers."""

import logging
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from touchline.bus import Bus, HealthReporter
from touchline.bus.last_sent import sent_by
from touchline.recordings.part_limits import UNLIMITED, PartLimits
from touchline.recordings.parts import next_part
from touchline.recordings.recorder import RecordingReport
from touchline.recordings.recording_file import RecordingError
from touchline.schemas import topics
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import (
    Clock,
    DiagnosticStatus,
    Event,
    Header,
    RecordRequest,
    RecordResponse,
    RecordStopResponse,
    Time,
)
from touchline.services.bridge.active_recording import ActiveRecording
from touchline.services.bridge.gateway import Gateway
from touchline.services.bridge.handshake import Handshake, shake_hands
from touchline.services.bridge.recording_folder import RecordingFolder
from touchline.services.bridge.recording_session import MOST_ROUNDS, RecordingSession
from touchline.services.bridge.standstill_detector import StandstillDetector
from touchline.supervision.shutdown import Stop

if TYPE_CHECKING:
    from touchline.services.bridge.foxglove.robot_viewers import Viewers

_LOG = logging.getLogger(__name__)
_IDLE_S = 0.002
_HANDSHAKE_TIMEOUT_S = 3.0
#: Processes that are waited for at the beginning and the end, and those of them whose messages are recorded.
_NEIGHBOURS = frozenset({topics.PLANNER, topics.TELEMETRY})
_PUBLISHERS = frozenset({topics.TELEMETRY})
#: After a standstill: time for a running process to answer, if there is still a link to it.
_QUICK_S = 0.5
#: Time in which a rejoining process knows everybody, and has the last message of each latched topic a little later.
_FOUND_S = 1.5
_LATCHED_S = 0.3
#: Period and number of repeated requests to silent processes, which may hang.
_ASK_AGAIN_S = 2.0
_ASK_AGAIN = 3
#: Sim time that robots may be ahead of a late recording, all of them together, and each at least: messages of this time
#: wait here, some 600 per second.
_AHEAD_S = 20.0
_AHEAD_EACH_S = 1.0
_LIMIT_EVERY_S = 0.1


class BridgeService:
    """Serves recording; everything happens in :meth:`run`'s one loop.

    Args:
        buses: Bus of each robot.
        recordings: Folder of requested recordings.
        gateways: Gateways to ROS 2, one for each robot, if any.
        viewers: Server of viewers, if any.
        stop: Called in waits that are longer than a turn of the loop, as a heartbeat; returns whether to end.
        active_recording: Note of the active recording, for a bridge after this one.
    """

    def __init__(
        self,
        buses: Sequence[Bus],
        recordings: RecordingFolder,
        gateways: Sequence[Gateway] = (),
        stop: Callable[[], bool] = lambda: False,
        active_recording: ActiveRecording | None = None,
        viewers: "Viewers | None" = None,
    ) -> None:
        self._viewers = viewers
        self._ends = [_RobotEnd(bus) for bus in buses]
        self._active_recording = active_recording
        self._continues: list[Path] = []
        self._parts: list[Path] = []
        self._limits = UNLIMITED
        self._folder = recordings
        self._stop = stop
        self._gateways = gateways
        self._session: RecordingSession | None = None
        self._failed: RecordingReport | None = None
        self._gaps_told = 0
        self._was_behind = False
        self._limited, self._limit_at_s = False, 0.0
        self._standstill = StandstillDetector()
        self._recovering = False
        self._ask_again = 0
        self._ask_again_s = 0.0

    def run(self, stop: Stop) -> RecordingReport | None:
        """Serve until ``stop``; an active recording is then finished and its report returned."""
        while not stop:
            if not self._turn():
                time.sleep(_IDLE_S)
        return self._finish()

    def go_on(self) -> None:
        """Resume, in a new file, the recording of a previous bridge that was killed; report if that fails."""
        parts, limits = self._active_recording.left_behind() if self._active_recording is not None else ([], UNLIMITED)
        if not parts:
            return
        path = next_part(parts)
        try:
            self.start(path, parts, limits)
        except RecordingError as error:
            text = f"the bridge was restarted while it recorded {parts[-1].name}, and cannot continue: {error}"
            for end in self._ends:
                end.publish(Event.ERROR, "recording-failed", text, 0)
            return
        text = (
            f"the bridge was restarted while it recorded {parts[-1].name}; it continues in {path.name}, "
            "what was sent in between is missing"
        )
        self._publish_event(Event.WARN, "recording-goes-on", text)

    def start(self, path: Path, continues: Sequence[Path] = (), limits: PartLimits = UNLIMITED) -> None:
        """Start to record; on return every publisher on the bus knows of it.

        Args:
            path: The file.
            continues: The files of the same recording before this one.
            limits: Limits of a part.

        Raises:
            RecordingError: A recording is active, or the file cannot be created or written.
        """
        if self._session is not None:
            raise RecordingError(f"{self._session.recorder.path} is being recorded; stop that first")
        self._failed, self._gaps_told = None, 0
        for end in self._ends:
            end.unasked.clear()
        namespaces = [end.bus.namespace for end in self._ends]
        recorder = self._folder.recorder(path, namespaces, continues)
        self._continues, self._limits = list(continues), limits
        inboxes = []
        for end in self._ends:  # of many robots this takes seconds
            self._breathe()
            inboxes.append(end.bus.inbox(topics.RECORDED))
        self._session = RecordingSession(recorder, inboxes, limits, continues)
        self._note_parts(self._session)
        self._account()
        if self._failed is not None:
            raise RecordingError(self._failed.problem)

    def _turn(self) -> bool:
        """Run one round of the loop; return whether there was anything to record."""
        self._standstill.turn(time.monotonic())
        if self._standstill.lost or (self._ask_again and time.monotonic() > self._ask_again_s):
            self._recover()
        for end in self._ends:
            gone = end.look()
            if gone and self._session is not None and self._session.behind:
                end.unasked |= gone
                self._ask_again = _ASK_AGAIN
        self._standstill.meet(self._ends[0].bus.peers)
        busy = self._pump()
        busy |= self._show()
        self._publish_problems()
        self._report_health()
        for end in self._ends:
            if (call := end.record.poll()) is not None:
                call.reply(self._answer_record(call.request))
            if (stop_call := end.record_stop.poll()) is not None:
                stop_call.reply(self._answer_stop())
        return busy

    def _show(self) -> bool:
        """Pass on to ROS 2 and to viewers what has arrived; return whether anything had."""
        busy = False
        for gateway in self._gateways:
            busy |= gateway.turn()
        if self._viewers is not None:
            busy |= self._viewers.turn()
        return busy

    def _publish_problems(self) -> None:
        """Publish problems of ROS 2 nodes' requests, each under its robot."""
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
        if self._session.parts != self._parts:
            self._note_parts(self._session)
        self._publish_gaps()
        self._limit(self._session, time.monotonic())
        return busy

    def _limit(self, session: RecordingSession, now_s: float) -> None:
        """Publish a limit on robots' sim time while the recording is behind, and its end."""
        if (session.behind or self._limited) and now_s >= self._limit_at_s:
            self._limited, self._limit_at_s = session.behind, now_s + _LIMIT_EVERY_S
            ahead_s = max(_AHEAD_S / len(self._ends), _AHEAD_EACH_S)
            for end in self._ends:
                if reached_ns := session.recorder.now_ns(end.bus.namespace):
                    end.limit.send(Clock(clock=Time.of_ns(reached_ns + round(1e9 * ahead_s))))

    def _note_parts(self, session: RecordingSession) -> None:
        """Note the recording's files, for a bridge after this one."""
        self._parts = session.parts
        if self._active_recording is not None:
            self._active_recording.note(self._parts, self._limits)

    def _publish_gaps(self) -> None:
        """Report, once for each stretch, that messages are missing."""
        if self._session is not None and not self._recovering and self._session.gaps > self._gaps_told:
            self._gaps_told = self._session.gaps
            text = f"the recording lacks {self._session.lost} messages so far; its metadata say where"
            self._publish_event(Event.WARN, "recording-fell-behind", text)

    def _publish_event(self, severity: int, code: str, text: str) -> None:
        """Publish an event under every robot, at its sim time in the recording."""
        assert self._session is not None
        _LOG.info("%s: %s", code, text)
        for end in self._ends:
            end.publish(severity, code, text, self._session.recorder.now_ns(end.bus.namespace))

    def _fail(self, error: RecordingError) -> None:
        """End a recording that cannot be written; leaving the bus's topics lets their publishers go on."""
        assert self._session is not None
        self._failed = self._session.finish()
        self._publish_event(Event.ERROR, "recording-failed", self._failed.problem or str(error))
        self._ended()

    def _ended(self) -> None:
        self._session = None
        if self._active_recording is not None:
            self._active_recording.forget()

    def _report_health(self) -> None:
        due = [(number, end) for number, end in enumerate(self._ends) if end.health.due]
        if not due:
            return
        level, message, values = self._health()
        for number, end in due:
            figures = self._gateways[number].figures() if self._gateways else {}
            if self._viewers is not None:
                figures |= self._viewers.figures(end.bus.namespace)
            end.health.poll({**values, **figures}, level=level, message=message)

    def _health(self) -> tuple[int, str, dict[str, object]]:
        """Return (level, message, figures) of the recording."""
        if self._failed is not None:
            return DiagnosticStatus.ERROR, self._failed.problem, {"recording": ""}
        if self._session is None:
            return DiagnosticStatus.OK, "idle", {"recording": ""}
        session = self._session
        values: dict[str, object] = {
            "recording": session.recorder.path,
            "messages": session.messages,
            "bytes": session.size_bytes,
            "lost_in_recording": session.lost,
            "rejected_in_recording": session.rejected,
        }
        flawed = session.lost or session.rejected
        return DiagnosticStatus.WARN if flawed else DiagnosticStatus.OK, "recording", values

    def _answer_record(self, request: RecordRequest) -> RecordResponse:
        try:
            path = self._folder.place(request.path)
            self.start(path, limits=PartLimits(request.max_bytes, request.max_s))
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
            message=report.problem or _in_words(report, self._continues, self._parts),
            path=str(report.path),
            messages=report.messages,
            bytes=report.bytes,
            lost=report.lost,
        )

    def _finish(self) -> RecordingReport | None:
        """Finish the recording with everything that was sent before this call."""
        if self._session is not None:
            cut_off = bool(self._unasked())
            self._account()
            if self._standstill.lost or (cut_off and self._unasked() and time.monotonic() > self._ask_again_s):
                self._recover()
        if self._session is None:  # there was none, or writing its last part failed
            return self._failed
        report = self._session.finish(self._unasked())
        self._ended()
        return report

    def _recover(self) -> None:
        """Recover from a standstill of this process: count losses, and rejoin the bus if it was cut off.

        A peer that has left meanwhile and one that has cut us off look alike until we rejoin.
        """
        stood_s = self._standstill.recovered()
        if stood_s:
            self._ask_again = _ASK_AGAIN
            for end in self._ends:
                end.unasked |= end.there & _PUBLISHERS
        self._recovering = True  # losses are reported when all is counted
        self._account(_QUICK_S)
        if self._waits_for_linked():
            self._account()
        # What is still in transit by a link would be lost with that.
        if not self._waits_for_linked() and (self._unasked() or self._lost_peers()):
            self._rejoin()
        self._recovering = False
        self._publish_gaps()
        unasked = self._unasked()
        self._ask_again = self._ask_again - 1 if unasked else 0
        self._ask_again_s = time.monotonic() + _ASK_AGAIN_S
        if unasked and stood_s and self._session is not None:
            text = f"the bridge stood still for {stood_s:.1f} s and cannot reach {', '.join(unasked)} any more"
            self._publish_event(Event.ERROR, "recording-cut-off", text)

    def _waits_for_linked(self) -> bool:
        """Return whether there is a link to a publisher that has not answered."""
        peers = self._ends[0].bus.peers()
        return any(end.presence.instances(node) & peers for end in self._ends for node in end.unasked)

    def _lost_peers(self) -> bool:
        """Return whether a link is gone that existed while this process ran steadily."""
        return bool(self._standstill.peers - self._ends[0].bus.peers())

    def _unasked(self) -> list[str]:
        """Return publishers, by robot, that could not be asked for their last messages."""
        return [f"{node} of {end.bus.namespace}" for end in self._ends for node in sorted(end.unasked)]

    def _rejoin(self) -> None:
        """Rejoin the bus; continue with what arrives there once all former peers are found, or time is up.

        At its end this process waits for a router that is gone no longer than for an answer.
        """
        wanted = {end: end.there | end.unasked for end in self._ends}
        bus, until_s = self._ends[0].bus, time.monotonic() + _HANDSHAKE_TIMEOUT_S
        try:
            bus.rejoin(lambda: self._breathe() and time.monotonic() > until_s)
        except TouchlineError as error:
            _LOG.warning("%s", error)
            return
        except KeyboardInterrupt:  # it is to end
            return
        deadline = time.monotonic() + _FOUND_S
        while time.monotonic() < deadline and any(nodes - end.presence.alive() for end, nodes in wanted.items()):
            for end in self._ends:
                end.presence.poll()
            self._while_waiting()
            time.sleep(_IDLE_S)
        latched = time.monotonic() + _LATCHED_S
        while time.monotonic() < latched:
            self._while_waiting()
            time.sleep(_IDLE_S)
        self._handshake()
        bus.leave_former()
        self._account()

    def _account(self, timeout_s: float = _HANDSHAKE_TIMEOUT_S) -> None:
        """Ensure that every publisher knows of us and that all it has sent is here, or count what is missing."""
        answers = self._handshake(timeout_s)
        self._catch_up()
        for end, handshake in zip(self._ends, answers, strict=True):
            end.unasked |= handshake.silent & _PUBLISHERS
            for node, diagnostics in handshake.answers.items():
                end.unasked.discard(node)
                if self._session is not None:
                    self._session.take_reports(end.bus.namespace, sent_by(node, diagnostics))
        self._publish_gaps()

    def _handshake(self, timeout_s: float = _HANDSHAKE_TIMEOUT_S) -> list[Handshake]:
        """Ask all publishers for their health, recording meanwhile.

        An answer comes behind all that was sent before: a publisher that has not answered in time, while that was more
        than could be recorded, is asked again.
        """
        answers = []
        for end in self._ends:
            while True:
                self._was_behind = False
                done = shake_hands(end.bus, end.presence, _NEIGHBOURS, timeout_s, self._while_waiting)
                if not done.silent or not self._was_behind:
                    break
            answers.append(done)
        return answers

    def _catch_up(self) -> None:
        """Record what has arrived by now; publishers may go on for ever."""
        for _ in range(MOST_ROUNDS):
            self._while_waiting()
            if self._session is None or not self._session.behind:
                break

    def _breathe(self) -> bool:
        """Beat, and return whether to end."""
        self._standstill.turn(time.monotonic())
        return self._stop()

    def _while_waiting(self) -> None:
        self._breathe()
        self._pump()
        self._was_behind |= self._session is not None and self._session.behind
        self._show()
        self._report_health()


class _RobotEnd:
    """Bridge's end of one robot's bus: asked by any of them, it records all."""

    def __init__(self, bus: Bus) -> None:
        self.bus = bus
        self.presence = bus.presence()
        self.health = HealthReporter(bus)
        self.record = bus.serve(topics.RECORD)
        self.record_stop = bus.serve(topics.RECORD_STOP)
        self.there: frozenset[str] = frozenset()
        """Neighbours that were there while this process ran steadily."""
        self.unasked: set[str] = set()
        """Publishers that could not be asked for their last messages since then."""
        self.limit = bus.publisher(topics.RECORDER_LIMIT)
        """Publishes the limit of sim time while the recording is behind."""
        self._events = bus.publisher(topics.EVENTS)

    def look(self) -> frozenset[str]:
        """Update presence; return publishers that have just gone, or have just cut us off."""
        self.presence.poll()
        before = self.there
        self.there = frozenset(self.presence.alive() & _NEIGHBOURS)
        return (before - self.there) & _PUBLISHERS

    def publish(self, severity: int, code: str, text: str, time_ns: int) -> None:
        """Publish an event for this robot's log."""
        header = Header(stamp=Time.of_ns(time_ns))
        self._events.send(Event(header=header, severity=severity, source=topics.BRIDGE, code=code, text=text))


def _in_words(report: RecordingReport, continues: Sequence[Path], parts: Sequence[Path]) -> str:
    text = f"recorded {report.messages} messages"
    if len(parts) > 1:
        text += f" in {', '.join(part.name for part in parts[len(continues) :])}"
    if continues:
        text += f", after {', '.join(part.name for part in continues)}, where the bridge was restarted"
    if report.lost:
        text += f"; {report.lost} were lost on the way"
    if report.rejected:
        text += f"; {report.rejected} payloads did not fit their topic or were damaged on the way, and are left out"
    return text
