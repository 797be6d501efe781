"""Recordings from the command line: what cannot be recorded is refused at once, and endings are told."""

import subprocess
import threading
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.command import app
from tests.system.commands import touchline_here
from touchline.bus import Bus, BusConfig, HealthReporter
from touchline.schemas import topics
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import (
    DiagnosticStatus,
    Event,
    RecordRequest,
    RecordResponse,
    RecordStopRequest,
    RecordStopResponse,
)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("noext", "ends in .mcap"),
        ("no/folder.mcap", "no such folder"),
        ("x" * 300 + ".mcap", "File name too long"),
        ("link.mcap", "choose another name"),
    ],
    ids=["extension", "folder", "long", "dangling"],
)
@pytest.mark.parametrize(
    "command",
    [["run", "square", "--record"], ["simulate", "square", "--record"], ["bridge", "--record"], ["record"]],
    ids=" ".join,
)
def test_what_cannot_be_recorded_is_refused_before_anything_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: list[str], name: str, said: str
) -> None:
    monkeypatch.setattr(Bus, "open", lambda *_: pytest.fail("the bus was opened"))
    (tmp_path / "link.mcap").symlink_to(tmp_path / "gone.mcap")
    result = CliRunner().invoke(app, [*command, str(tmp_path / name)])
    assert isinstance(result.exception, TouchlineError), result.output
    assert said in str(result.exception) and "\n" not in str(result.exception)


class Bridge:
    """A bridge as others see it; the test says what becomes of its recording."""

    def __init__(self, bus: Bus) -> None:
        self._health = HealthReporter(bus)
        self._events = bus.publisher(topics.EVENTS)
        self._record, self._stop = bus.serve(topics.RECORD), bus.serve(topics.RECORD_STOP)
        self.path = ""
        self.problem = ""

    def turn(self, over: threading.Event, until_recording: bool = False) -> None:
        """Answer until it is over, or recording has begun."""
        while not (over.wait(0.01) or (until_recording and self.path)):
            level = DiagnosticStatus.ERROR if self.problem else DiagnosticStatus.OK
            message = self.problem or ("recording" if self.path else "idle")
            self._health.poll({"recording": self.path}, level=level, message=message)
            if (call := self._record.poll()) is not None:
                assert isinstance(call.request, RecordRequest)
                self.path = call.request.path
                call.reply(RecordResponse(success=True))
            if (stop := self._stop.poll()) is not None:
                assert isinstance(stop.request, RecordStopRequest)
                stop.reply(RecordStopResponse(success=True, message="all well", path=self.path))

    def end(self, problem: str) -> None:
        self.path, self.problem = "", problem
        if problem:
            self._events.send(Event(severity=Event.ERROR, source=topics.BRIDGE, code="recording-failed", text=problem))


def recorded_until(config: BusConfig, path: Path, problem: str) -> "subprocess.CompletedProcess[str]":
    """`touchline record`; as soon as it records, that ends."""
    over = threading.Event()
    with Bus.open(topics.BRIDGE, config) as bus:
        bridge = Bridge(bus)

        def serve() -> None:
            bridge.turn(over, until_recording=True)
            bridge.end(problem)
            bridge.turn(over)

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            return touchline_here("record", str(path), config=config)
        finally:
            over.set()
            thread.join()


def test_the_end_of_a_recording_is_told_at_once(bus_config: BusConfig, tmp_path: Path) -> None:
    done = recorded_until(bus_config, tmp_path / "a.mcap", "the disk is full")
    assert done.returncode == 2
    assert "the recording has ended: the disk is full" in done.stderr


def test_a_recording_that_somebody_else_has_stopped_is_told(bus_config: BusConfig, tmp_path: Path) -> None:
    assert "somebody else has stopped it" in recorded_until(bus_config, tmp_path / "a.mcap", "").stderr
