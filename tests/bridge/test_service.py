"""The bridge as a real process on a real bus; the test is the robot and the operator."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.bridge.said import messages, record, sent, stamp
from tests.meeting import eventually
from touchline.bus import Bus, BusConfig, HealthReporter
from touchline.recordings.channels import is_drawn
from touchline.recordings.reader import RecordingReader, read_summary
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import (
    Clock,
    DiagnosticArray,
    DiagnosticStatus,
    Event,
    GetDiagnosticsRequest,
    RecordRequest,
    RecordResponse,
    RecordStopRequest,
    RecordStopResponse,
)
from touchline.services.bridge.replay_service import Playback, run_replay

BRIDGE = (
    "from touchline.services.bridge.service import run_service; run_service({arguments}recordings=Path({folder!r}))"
)
ROOT = Path(__file__).resolve().parents[2]


class Robot:
    """The test's end of the bus: publishes, asks, and says how it is whenever it waits."""

    def __init__(self, bus: Bus) -> None:
        self.bus = bus
        self.health = HealthReporter(bus)
        self.publishers = {topic.name: bus.publisher(topic) for topic in topics.RECORDED}
        self._requests = 0

    def say(self, ticks: int) -> list[tuple[str, bytes]]:
        """Publish the usual messages; returns them as a recording should have them."""
        said = []
        for topic, message in messages(ticks):
            payload = encode(message)
            self.publishers[topic.name].send_bytes(payload)
            said.append((f"/tt2/{topic.name}", payload))
        return said

    def record(self, path: str | Path, max_s: float = 0.0) -> RecordResponse:
        self._requests += 1
        request = RecordRequest(request_id=f"record {self._requests}", path=str(path), max_s=max_s)
        return self.bus.call(topics.RECORD, request, 60.0, self.poll)

    def stop(self) -> RecordStopResponse:
        self._requests += 1
        request = RecordStopRequest(request_id=f"stop {self._requests}")
        return self.bus.call(topics.RECORD_STOP, request, 60.0, self.poll)

    def poll(self) -> None:
        self.health.poll({})


@pytest.fixture
def config(bus_config: BusConfig) -> BusConfig:
    return bus_config


@pytest.fixture
def robot(config: BusConfig) -> Iterator[Robot]:
    with Bus.open(topics.TELEMETRY, config) as bus:  # whose messages the bridge waits for
        yield Robot(bus)


def environment(config: BusConfig) -> Mapping[str, str]:
    return {**os.environ, **config.environment()}


@contextmanager
def bridge(bus: Bus, folder: Path, arguments: str = "", before: str = "") -> Iterator[subprocess.Popen[bytes]]:
    """A bridge process that is on the bus and records to ``folder``."""
    code = BRIDGE.format(arguments=arguments, folder=str(folder))
    command = [sys.executable, "-c", f"from pathlib import Path\n{before}\n{code}"]
    process = subprocess.Popen(command, cwd=ROOT, env=environment(bus.config))
    presence = bus.presence()
    try:
        assert not bus.wait_for({topics.BRIDGE}, 100.0)
        yield process
    finally:
        process.kill()
        process.wait()
        # Else the next one would be believed to be there while this one's token is still seen.
        assert eventually(lambda: (presence.poll(), topics.BRIDGE not in presence.alive())[1])


def contents(path: Path) -> list[tuple[str, bytes]]:
    items = RecordingReader(path).messages()
    return [(item.topic, item.payload) for item in items if not is_drawn(item.topic, ("tt2", "copy"))]


def until(robot: Robot, condition: Callable[[], bool], timeout_s: float = 100.0) -> None:
    deadline = time.monotonic() + timeout_s
    while not condition():
        robot.poll()
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.01)


def recording_since_start(robot: Robot) -> bool:
    """Return whether a bridge that records from its start has shaken hands: it answers, and says so."""
    request = GetDiagnosticsRequest()
    answer = robot.bus.call(topics.diagnostics_service(topics.BRIDGE), request, 60.0, robot.poll)
    return answer.diagnostics.status[0].message == "recording"


def test_everything_between_record_and_stop_is_recorded_in_the_order_of_sending(robot: Robot, tmp_path: Path) -> None:
    path = tmp_path / "session.mcap"
    with bridge(robot.bus, tmp_path):
        assert robot.record(path).success
        said = robot.say(3000)
        answer = robot.stop()
        robot.say(10)
        assert robot.record(tmp_path / "second.mcap").success
        said_later = robot.say(100)
        assert robot.stop().success
    assert answer.success, answer.message
    assert (answer.messages, answer.lost, answer.path) == (len(said), 0, str(path))
    assert answer.bytes == path.stat().st_size
    # The text without a stamp waits for the first clock, and is written behind nothing else.
    assert contents(path) == said
    assert read_summary(path).complete
    second, latched = contents(tmp_path / "second.mcap"), {"/tt2/template", "/tt2/traversal/status"}
    # A late joiner is given the last message of the latched topics, then all that is sent.
    assert [item for item in second if item[0] not in latched] == [
        item for item in said_later if item[0] not in latched
    ]
    assert sum(topic == "/tt2/template" for topic, _ in second) == 2


def test_what_cannot_be_done_is_refused_with_a_reason(robot: Robot, tmp_path: Path) -> None:
    folder, elsewhere = tmp_path / "recordings", tmp_path / "elsewhere"
    folder.mkdir()
    elsewhere.mkdir()
    (folder / "out").symlink_to(elsewhere)
    (folder / "loop").symlink_to("loop")
    (folder / "note.mcap").write_text("not a recording")
    (folder / "link.mcap").symlink_to(elsewhere / "a.mcap")
    (folder / "folder.mcap").mkdir()
    os.mkfifo(folder / "pipe.mcap")
    before = {path.name for path in folder.iterdir()}
    refused = {
        "missing/a.mcap": "folder does not exist",
        "loop/a.mcap": "folder does not exist",
        "a.txt": "ends in .mcap",
        "a\0b.mcap": "no control characters",
        "a\nb\x1b[2J.mcap": "no control characters",
        "": "no control characters",
        f"{'x' * 300}.mcap": "at most 200 bytes",
        f"{'x/' * 5000}a.mcap": "at most 200 bytes",
        "../a.mcap": "outside of the recordings folder",
        "out/a.mcap": "outside of the recordings folder",
        "..": "outside of the recordings folder",
        "/dev/null": "outside of the recordings folder",
        "/dev/shm/a.mcap": "outside of the recordings folder",
        str(elsewhere / "a.mcap"): "give a path in it, or choose another with --recordings",
        "note.mcap": "is no recording",
        "link.mcap": "is no recording",
        "folder.mcap": "is no recording",
        "pipe.mcap": "is no recording",
    }
    with bridge(robot.bus, folder):
        assert "nothing is being recorded" in robot.stop().message
        for path, reason in refused.items():
            answer = robot.record(path)
            assert not answer.success, path
            assert reason in answer.message, path
            assert "\x1b" not in answer.message
        assert {path.name for path in folder.iterdir()} == before
        assert list(elsewhere.iterdir()) == []
        assert robot.record("a.mcap").success
        assert "stop that first" in robot.record(folder / "b.mcap").message
        assert robot.stop().path == str(folder / "a.mcap")
        assert robot.record(f"{'é' * 97}.mcap").success
        assert robot.stop().success
    assert (folder / "note.mcap").read_text() == "not a recording"


def test_killed_and_started_again_it_goes_on_in_the_next_part_and_says_so(robot: Robot, tmp_path: Path) -> None:
    heard = robot.bus.inbox([topics.EVENTS])
    supervised = f"supervisor={os.getpid()}, "
    said = []
    with bridge(robot.bus, tmp_path, supervised) as process:
        assert "give at least" in robot.record("session.mcap", max_s=0.1).message
        assert robot.record("session.mcap", max_s=5.0).success
        said.append(robot.say(200))
        until(robot, lambda: sent(read_summary(tmp_path / "session.mcap")) == len(said[0]))
        process.send_signal(signal.SIGKILL)
        process.wait()
    with bridge(robot.bus, tmp_path, supervised):
        until(robot, lambda: recording_since_start(robot))
        said.append(robot.say(700))
        until(robot, (tmp_path / "session.part3.mcap").exists)  # it keeps to the limits
        answer = robot.stop()
    assert answer.success and answer.path == str(tmp_path / "session.part2.mcap")
    assert "in session.part2.mcap, session.part3.mcap, after session.mcap, where the bridge was" in answer.message
    session = [item for item in contents(tmp_path / "session.mcap") if item[0] != "/tt2/events"]
    assert session == said[0] + said[1]  # the parts are one session
    assert read_summary(tmp_path / "session.part2.mcap").metadata["touchline_part"] == {
        "part": "2",
        "before": "session.mcap",
    }
    told = [message for _, message in heard.messages() if isinstance(message, Event)]
    assert [event.code for event in told] == ["recording-goes-on"]
    assert "it continues in session.part2.mcap" in told[0].text
    with bridge(robot.bus, tmp_path, supervised):  # it was stopped in good order: nothing goes on
        assert "nothing is being recorded" in robot.stop().message


def test_a_signal_finishes_the_recording_that_was_begun_with_the_bridge(robot: Robot, tmp_path: Path) -> None:
    path = tmp_path / "session.mcap"
    with bridge(robot.bus, tmp_path, f"Path({str(path)!r}), ") as process:
        until(robot, path.exists)
        until(robot, lambda: recording_since_start(robot))
        said = robot.say(300)
        process.send_signal(signal.SIGTERM)
        until(robot, lambda: process.poll() is not None)
        assert process.returncode == 0
    assert contents(path) == said
    assert read_summary(path).complete


LIMIT_FILE_SIZE = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (75_000, resource.RLIM_INFINITY))"


def test_a_full_disk_ends_the_recording_but_not_the_service(robot: Robot, tmp_path: Path) -> None:
    diagnostics = robot.bus.inbox([topics.DIAGNOSTICS, topics.EVENTS])
    with bridge(robot.bus, tmp_path, before=LIMIT_FILE_SIZE):
        assert robot.record(tmp_path / "full.mcap").success
        robot.say(3000)  # twice what fits; nothing of it may block the robot for good
        told: list[str] = []

        def failure_told() -> bool:
            for sample, message in diagnostics.messages():
                if sample.topic is topics.EVENTS:
                    told.append("event")
                elif isinstance(message, DiagnosticArray) and message.status[0].level == DiagnosticStatus.ERROR:
                    told.append(message.status[0].message)
            return len(set(told)) == 2

        until(robot, failure_told)
        answer = robot.stop()
        assert not answer.success and "cannot write" in answer.message
        assert sent(read_summary(tmp_path / "full.mcap")) == answer.messages > 0
        assert robot.record(tmp_path / "small.mcap").success
        robot.say(5)
        assert robot.stop().success
    assert any("cannot write" in text for text in told)


def test_a_replay_arrives_complete_and_in_order(config: BusConfig, tmp_path: Path) -> None:
    original = record(tmp_path / "original.mcap", messages(3000)).finish().path
    with Bus.open(topics.ROBOT_SIM, config), pytest.raises(CommandRefused, match="a robot is on the bus"):
        run_replay(original, config=config)
    elsewhere = BusConfig(endpoint=config.endpoint, namespaces=("copy",))
    with Bus.open("operator", elsewhere) as bus, bridge(bus, tmp_path):
        operator = Robot(bus)
        assert operator.record(tmp_path / "copy.mcap").success
        assert run_replay(original, Playback(0.0), elsewhere).skipped == 0
        answer = operator.stop()
    assert answer.lost == 0
    copied = [(name.replace("/copy/", "/tt2/"), payload) for name, payload in contents(tmp_path / "copy.mcap")]
    assert copied == contents(original)


def test_a_replay_keeps_the_pace_and_tells_how_far_it_is(config: BusConfig, tmp_path: Path) -> None:
    original = record(tmp_path / "original.mcap", messages(200)).finish().path
    told: list[tuple[float, float]] = []
    with Bus.open("operator", config) as bus:
        inbox = bus.inbox([topics.CLOCK])
        begun = time.monotonic()
        report = run_replay(original, Playback(4.0, loops=2), config, progress=lambda *state: told.append(state))
        took_s = time.monotonic() - begun
        said = [Clock(clock=stamp(tick)) for _ in range(2) for tick in range(0, 200, 10)]
        clocks: list[object] = []
        deadline = time.monotonic() + 60.0
        while len(clocks) < len(said) and time.monotonic() < deadline:  # the last ones may be under way still
            clocks += [message for _, message in inbox.messages()]
    assert report.sent == 2 * len(contents(original))
    assert report.sim_time_s == pytest.approx(2 * 1.99)
    assert took_s >= report.sim_time_s / 4.0
    assert clocks == said
    assert told[-1] == (1.0, pytest.approx(1.99))


def test_a_replay_can_be_stopped(config: BusConfig, tmp_path: Path) -> None:
    original = record(tmp_path / "original.mcap", messages(200)).finish().path
    calls = iter(range(1000))
    assert run_replay(original, Playback(0.0, loops=0), config, stop=lambda: next(calls) > 50).sent < 60
