"""``touchline record``: the session on the bus to a file."""

import sys
import time
import uuid
from pathlib import Path
from typing import Annotated, Any

import typer

from touchline.bus import Bus
from touchline.bus.config import named_robots
from touchline.cli.display import print_event, print_figures, print_json, say
from touchline.cli.options import ExitCode, JsonOption, RobotOption, config_of
from touchline.jobs.recording.recording_end import end_recording, lacking
from touchline.recordings.writing import check_recordable
from touchline.schemas import topics
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import DiagnosticArray, DiagnosticStatus, Event, RecordRequest
from touchline.supervision.shutdown import until_stopped

#: Time for a supervisor to restart a killed bridge.
_RETURN_S = 15.0
#: Time for a newcomer on the bus to find all of its robots.
_LOOK_S = 0.5


def register(app: typer.Typer) -> None:
    """Add the subcommand to `app`."""
    app.command("record")(record)


def record(
    file: Annotated[Path, typer.Argument(metavar="FILE.mcap", help="Recording to write.")],
    seconds: Annotated[float, typer.Option(metavar="S", help="Duration, s (0: until Ctrl-C).", min=0.0)] = 0.0,
    robot: RobotOption = None,
    max_size: Annotated[
        float, typer.Option(metavar="MB", help="Start a new part at this size, MB (0: never).", min=0.0)
    ] = 0.0,
    max_time: Annotated[
        float, typer.Option(metavar="S", help="Start a new part after this sim time, s (0: never).", min=0.0)
    ] = 0.0,
    as_json: JsonOption = False,
) -> None:
    """Record the session on the bus until Ctrl-C; exit code 1 if something is lost, or recording ends early.

    The running bridge records all robots that it serves; --robot chooses among several bridges.
    """
    check_recordable(file)
    named = robot is not None or bool(named_robots())
    with Bus.open(topics.OPERATOR, config_of(robot)) as first, until_stopped() as stop:
        bus = first if named else _with_bridge(first)
        watch = _Watch(bus)
        limits = {"max_bytes": round(max_size * 1e6), "max_s": max_time}
        request = RecordRequest(request_id=uuid.uuid4().hex, path=str(file.absolute()), **limits)
        begun = bus.call(topics.RECORD, request)
        if not begun.success:
            raise TouchlineError(begun.message)
        say(f"recording to {file}; Ctrl-C stops")
        watch.begin()
        deadline = time.monotonic() + seconds if seconds else float("inf")
        while not stop and time.monotonic() < deadline:
            watch.check()
            time.sleep(0.05)
        done = end_recording(bus, say)
    problem = lacking(done, file)
    if done is None or not done.path:
        raise TouchlineError(problem)
    figures: dict[str, Any] = {"path": done.path, "messages": done.messages, "bytes": done.bytes, "lost": done.lost}
    figures["interrupted"] = watch.interrupted
    if problem:
        figures["problem"] = problem
    if as_json:
        print_json(figures)
    else:
        print_figures(f"Recording {file}", figures)
    if watch.interrupted:
        print_event(Event.WARN, done.message)
    if not done.success:
        raise TouchlineError(problem)
    if problem:
        print_event(Event.ERROR, f"the recording is not complete: {problem}")
    if problem or watch.interrupted:
        sys.exit(ExitCode.FAILED)


def _with_bridge(bus: Bus) -> Bus:
    """Return the bus of the default robot if it has a bridge or none has, else of the first robot that has one."""
    robots = bus.roster().look({topics.BRIDGE}, _LOOK_S)
    return bus if not robots or bus.namespace in robots else bus.of(robots[0])


class _Watch:
    """Observer of the bridge's recording, by its diagnostics and its presence.

    Attributes:
        interrupted: Whether the recording was interrupted and continued in a next file.
    """

    def __init__(self, bus: Bus) -> None:
        self._presence = bus.presence()
        self._inbox = bus.inbox([topics.EVENTS, topics.DIAGNOSTICS], keep="recent")
        self._gone_s: float | None = None
        self.interrupted = False

    def begin(self) -> None:
        """Start a recording: earlier diagnostics are forgotten."""
        self._inbox.drain()

    def check(self) -> None:
        """Report changes at once.

        Raises:
            TouchlineError: The recording has ended.
        """
        self._presence.poll()
        if topics.BRIDGE not in self._presence.alive():
            if self._gone_s is None:
                self._gone_s = time.monotonic()
                print_event(Event.ERROR, "the bridge is gone, and nothing is being recorded; waiting for it to return")
            elif time.monotonic() > self._gone_s + _RETURN_S:
                raise TouchlineError("the recording has ended: the bridge has not returned")
        for _, message in self._inbox.messages():
            if isinstance(message, Event) and message.source == topics.BRIDGE:
                self.interrupted |= message.code == "recording-goes-on"
                print_event(message.severity, message.text)
            elif isinstance(message, DiagnosticArray):
                for status in message.status:
                    self._check_status(status)

    def _check_status(self, status: DiagnosticStatus) -> None:
        if status.name != topics.BRIDGE:
            return
        if status.message == "recording":
            self._gone_s = None
        elif any(pair.key == "recording" and not pair.value for pair in status.values):
            idle = "somebody else has stopped it" if self._gone_s is None else "the bridge was restarted"
            raise TouchlineError(f"the recording has ended: {idle if status.message == 'idle' else status.message}")
