"""A recorder that cannot take messages as fast as they come says how far sim time may go."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.bridge.test_service import Robot, bridge, until
from touchline.bus import Bus, BusConfig
from touchline.schemas import topics
from touchline.schemas.messages import Clock

#: The bridge's recorder takes half a millisecond more for each message.
SLOW = """
import time
from touchline.recordings.recorder import Recorder
write = Recorder.write
Recorder.write = lambda *given: (time.sleep(0.0005), write(*given))[1]
"""


@pytest.fixture
def robot(bus_config: BusConfig) -> Iterator[Robot]:
    with Bus.open(topics.TELEMETRY, bus_config) as bus:
        yield Robot(bus)


def test_a_recorder_that_is_behind_gives_a_limit_and_takes_it_back(robot: Robot, tmp_path: Path) -> None:
    limits = robot.bus.inbox([topics.RECORDER_LIMIT])
    heard: list[float] = []

    def listen() -> list[float]:
        heard.extend(message.clock.seconds for _, message in limits.messages() if isinstance(message, Clock))
        return heard

    with bridge(robot.bus, tmp_path, before=SLOW):
        assert robot.record("behind.mcap").success
        robot.say(100)
        assert robot.stop().success
        assert not listen(), "it was not behind"
        assert robot.record("far-behind.mcap").success
        robot.say(4000)
        until(robot, lambda: len(listen()) > 3)
        assert heard == sorted(heard)
        assert heard[0] < 40.0
        until(robot, lambda: listen()[-1] > 50.0)  # as far as it has come, and 20 s
        report = robot.stop()
    assert report.lost == 0
