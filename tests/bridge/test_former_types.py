"""Recordings made when a topic had another type are compared and replayed as if they had today's."""

import struct
from pathlib import Path

import pytest

from tests.bridge.foreign import foreign
from touchline.recordings.compare import compare
from touchline.recordings.former_types import presented
from touchline.recordings.reader import RecordingReader
from touchline.recordings.replay.replayer import Timeline
from touchline.schemas import topics
from touchline.schemas.cdr import encode, full_definition
from touchline.schemas.messages import ActuatorCommand, Header, Time

FORMER_TYPE = "touchline_msgs/msg/WheelCommand"
FORMER_SCHEMA = (
    "# Commanded wheel rates.\nstd_msgs/Header header\nfloat64 left_radps\nfloat64 right_radps\n"
    f"{'=' * 80}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    f"{'=' * 80}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)
SAID = [(3, 10_000_000, 1.5, -2.25), (3, 20_000_000, 0.0, 19.999)]


def former(sec: int, nanosec: int, left: float, right: float) -> bytes:
    """A wheel command as it was sent."""
    frame = b"base_link\0"
    return b"\0\1\0\0" + struct.pack(f"<iII{len(frame)}s2x2d", sec, nanosec, len(frame), frame, left, right)


def present(sec: int, nanosec: int, left: float, right: float) -> bytes:
    header = Header(stamp=Time(sec=sec, nanosec=nanosec), frame_id="base_link")
    return encode(ActuatorCommand(header=header, names=("left", "right"), values=[left, right]))


def older(path: Path, said: list[tuple[int, int, float, float]] = SAID) -> Path:
    data = [("/tt2/cmd/wheels", sec * 10**9 + ns, former(sec, ns, *rates)) for sec, ns, *rates in said]
    return foreign(path, data, type_=FORMER_TYPE, schema=FORMER_SCHEMA)


def newer(path: Path, said: list[tuple[int, int, float, float]] = SAID) -> Path:
    data = [("/tt2/cmd/actuators", sec * 10**9 + ns, present(sec, ns, *rates)) for sec, ns, *rates in said]
    return foreign(path, data, type_=ActuatorCommand.ros_type, schema=full_definition(ActuatorCommand))


def test_wheel_commands_are_compared_with_commands_to_actuators(tmp_path: Path) -> None:
    old, new = older(tmp_path / "old.mcap"), newer(tmp_path / "new.mcap")
    for pair in ((old, new), (new, old), (old, older(tmp_path / "again.mcap"))):
        result = compare(*pair)
        assert result.identical and list(result.topics) == ["/tt2/cmd/actuators"]
        assert result.topics["/tt2/cmd/actuators"].pairs == 2
    assert compare(old, new, {"/tt2/cmd/wheels"}).identical


def test_another_command_is_another_one(tmp_path: Path) -> None:
    old = older(tmp_path / "old.mcap")
    new = newer(tmp_path / "new.mcap", [SAID[0], (*SAID[1][:3], 19.99)])
    result = compare(old, new)
    assert not result.same
    (difference,) = result.topics["/tt2/cmd/actuators"].first
    assert (difference.field, difference.index) == ("values[1]", 1)


def test_wheel_commands_are_replayed_as_commands_to_actuators(tmp_path: Path) -> None:
    timeline = Timeline(older(tmp_path / "old.mcap"))
    cues = list(timeline.cues())
    assert [(cue.topic, cue.payload) for cue in cues] == [(topics.ACTUATOR_COMMAND, present(*said)) for said in SAID]
    assert (timeline.skipped, timeline.reasons) == (0, [])


def test_what_is_no_wheel_command_is_left_as_it_is(tmp_path: Path) -> None:
    data = [("/tt2/cmd/wheels", 5, b"\0\1\0\0\1\2")]
    path = foreign(tmp_path / "torn.mcap", data, type_=FORMER_TYPE, schema=FORMER_SCHEMA)
    (message,) = RecordingReader(path).messages()
    assert presented(message) is message
    timeline = Timeline(path)
    assert list(timeline.cues()) == [] and timeline.skipped == 1


@pytest.mark.parametrize("schema", ["", "no definition {"])
def test_without_a_schema_that_can_be_read_it_is_left_as_it_is(tmp_path: Path, schema: str) -> None:
    data = [("/tt2/cmd/wheels", 5, former(*SAID[0]))]
    (message,) = RecordingReader(foreign(tmp_path / "bare.mcap", data, type_=FORMER_TYPE, schema=schema)).messages()
    assert presented(message) is message
