"""A bridge that stood still says what it lacks, and is back on the bus."""

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.bridge.test_service import Robot, bridge, contents
from touchline.bus import Bus, BusConfig
from touchline.bus.config import PATIENCE_S
from touchline.recordings.reader import read_summary
from touchline.schemas import topics
from touchline.schemas.messages import Event, RecordStopRequest, RecordStopResponse

#: Some of these fill every buffer on the way to who does not take them.
LARGE = "x" * 200_000
BURST = 100


@pytest.fixture
def robot(bus_config: BusConfig) -> Iterator[Robot]:
    with Bus.open(topics.TELEMETRY, bus_config) as bus:
        yield Robot(bus)


@contextmanager
def frozen(process: subprocess.Popen[bytes]) -> Iterator[None]:
    process.send_signal(signal.SIGSTOP)
    os.waitid(os.P_PID, process.pid, os.WSTOPPED)
    try:
        yield
    finally:
        process.send_signal(signal.SIGCONT)


def speak_until_cut_off(robot: Robot) -> int:
    """Publish until the bridge is cut off because it takes nothing; returns how many messages.

    Nobody takes what goes fast when it was slow before.
    """
    took_s = [0.0]
    while not (max(took_s) > 0.9 * PATIENCE_S and took_s[-1] < 0.3 * PATIENCE_S):
        assert len(took_s) < 100, "it is never cut off"
        begun_s = time.monotonic()
        for _ in range(BURST):
            robot.publishers[topics.EVENTS.name].send(Event(source="robot", text=LARGE))
        took_s.append(time.monotonic() - begun_s)
    return BURST * (len(took_s) - 1)


def test_what_a_frozen_bridge_has_missed_is_counted_though_nothing_comes_after_it(robot: Robot, tmp_path: Path) -> None:
    with bridge(robot.bus, tmp_path) as process:
        heard = robot.bus.inbox([topics.EVENTS])
        assert robot.record("frozen.mcap").success
        said = len(robot.say(100))
        with frozen(process):
            said += speak_until_cut_off(robot) + len(robot.say(100))
        answer = robot.stop()
        told = [event for _, event in heard.messages() if isinstance(event, Event) and event.source == topics.BRIDGE]
        # It is back: what is said now is recorded, and nothing lacks.
        assert robot.record("after.mcap").success
        spoken = robot.say(100)
        after = robot.stop()
    summary = read_summary(tmp_path / "frozen.mcap")
    by_bridge = len(told)
    assert answer.success and answer.lost > 0
    assert (answer.messages - by_bridge) + answer.lost == said
    lost = summary.metadata["touchline_lost"]
    assert lost["total"] == str(answer.lost)
    assert int(lost["/tt2/imu/data_raw"]) + summary.topics["/tt2/imu/data_raw"].messages == 200
    assert [event.code for event in told] == ["recording-fell-behind"]
    assert after.success and after.lost == 0
    assert contents(tmp_path / "after.mcap")[-len(spoken) :] == spoken


def test_a_recording_whose_publisher_left_while_the_bridge_was_cut_off_may_lack_its_end(
    bus_config: BusConfig, tmp_path: Path
) -> None:
    with Bus.open(topics.OPERATOR, bus_config) as operator, bridge(operator, tmp_path) as process:
        with Bus.open(topics.TELEMETRY, bus_config) as bus:
            robot = Robot(bus)
            assert not bus.wait_for({topics.BRIDGE}, 60.0)
            assert robot.record("cut.mcap").success
            robot.say(100)
            process.send_signal(signal.SIGSTOP)
            speak_until_cut_off(robot)
        process.send_signal(signal.SIGCONT)
        answer = operator.call(topics.RECORD_STOP, RecordStopRequest(request_id="stop"), 60.0)
    assert not answer.success
    assert "its end may be missing: telemetry of tt2" in answer.message
    assert read_summary(tmp_path / "cut.mcap").metadata["touchline_unasked"] == {"publishers": "telemetry of tt2"}


def left_in_order(bus_config: BusConfig, folder: Path) -> tuple[RecordStopResponse, list[tuple[str, bytes]]]:
    """Answer of a bridge that ends a recording after the publisher has left, and the last report of that."""
    folder.mkdir()
    with Bus.open(topics.OPERATOR, bus_config) as operator, bridge(operator, folder):
        with Bus.open(topics.TELEMETRY, bus_config) as bus:
            robot = Robot(bus)
            assert not bus.wait_for({topics.BRIDGE}, 60.0)
            assert robot.record("whole.mcap").success
            said = robot.say(100)
            assert not robot.record("second.mcap").success  # refused once all that was said before it is taken
        return operator.call(topics.RECORD_STOP, RecordStopRequest(request_id="stop"), 60.0), said


def test_a_publisher_that_has_left_in_order_spoils_nothing(bus_config: BusConfig, tmp_path: Path) -> None:
    for attempt in range(10):
        answer, said = left_in_order(bus_config, folder := tmp_path / str(attempt))
        if answer.success:
            assert answer.lost == 0
            assert contents(folder / "whole.mcap") == said
            return
        # A bridge that a busy machine held up just then cannot know.
        assert "its end may be missing" in answer.message
    pytest.fail(answer.message)
