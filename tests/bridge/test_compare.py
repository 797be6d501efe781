"""A comparison finds what differs, and only that."""

import math
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.bridge.said import messages, record, stamp
from touchline.recordings.compare import compare
from touchline.recordings.recorder import Recorder
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.messages import Header, Imu, Message, Vector3
from touchline.schemas.topics import Topic

Said = Iterator[tuple[Topic, Message]]


def imu(tick: int, rate_radps: float) -> Imu:
    return Imu(header=Header(stamp=stamp(tick), frame_id="base_link"), angular_velocity=Vector3(z=rate_radps))


def changed(tick: int, change: Callable[[float], float]) -> Said:
    """The usual messages, with the yaw rate of one IMU message changed."""
    count = 0
    for topic, message in messages(200):
        said = message
        if isinstance(message, Imu):
            if count == tick:
                said = imu(tick, change(message.angular_velocity.z))
            count += 1
        yield topic, said


def test_a_recording_is_identical_to_itself_in_another_order(tmp_path: Path, recording: Path) -> None:
    said = sorted(messages(200), key=lambda item: item[0].name)
    other = record(tmp_path / "other.mcap", iter(said)).finish().path
    result = compare(recording, other)
    assert result.identical and result.same
    assert list(result.lines()) == [f"{len(said)} messages of 6 topics are identical"]


def test_one_changed_byte_is_found(tmp_path: Path, recording: Path) -> None:
    said = list(messages(200))
    other = tmp_path / "other.mcap"
    recorder = Recorder(other)
    for number, (topic, message) in enumerate(said):
        payload = bytearray(encode(message))
        if number == 100:
            payload[-1] ^= 0x01
            name = f"/tt2/{topic.name}"
        recorder.write(topic.name, bytes(payload), number)
    recorder.finish()
    result = compare(recording, other)
    assert not result.identical
    assert [topic for topic, found in result.topics.items() if found.identical != found.left] == [name]


def test_a_difference_within_the_tolerance_is_not_identical_but_the_same(tmp_path: Path, recording: Path) -> None:
    other = record(tmp_path / "other.mcap", changed(50, lambda rate: rate + 0.5 * topics.IMU.tolerance)).finish().path
    result = compare(recording, other)
    assert result.same and not result.identical
    found = result.topics["/tt2/imu/data_raw"]
    assert (found.within_tolerance, found.different) == (1, 0)
    assert 0 < found.largest <= topics.IMU.tolerance


@pytest.mark.parametrize("change", [lambda rate: rate + 0.25, lambda _: math.nan], ids=["far", "nan"])
def test_a_difference_beyond_the_tolerance_names_the_field(
    tmp_path: Path, recording: Path, change: Callable[[float], float]
) -> None:
    other = record(tmp_path / "other.mcap", changed(50, change)).finish().path
    result = compare(recording, other)
    assert not result.same
    difference = result.topics["/tt2/imu/data_raw"].first[0]
    assert (difference.index, difference.field, difference.left) == (50, "angular_velocity.z", "25.0")
    assert any("message 50 at 0.500 s: angular_velocity.z: 25.0 against" in line for line in result.lines())


def test_nan_equals_nan(tmp_path: Path) -> None:
    paths = [record(tmp_path / f"{name}.mcap", changed(50, lambda _: math.nan)).finish().path for name in "ab"]
    assert compare(*paths).identical


def test_zeros_of_either_sign_are_the_same_but_not_identical(tmp_path: Path, recording: Path) -> None:
    other = record(tmp_path / "other.mcap", changed(0, lambda _: -0.0)).finish().path
    result = compare(recording, other)
    assert result.same and not result.identical


def test_missing_messages_are_told(tmp_path: Path, recording: Path) -> None:
    other = record(tmp_path / "other.mcap", messages(190)).finish().path
    result = compare(recording, other)
    assert not result.same
    missing = (
        "/tt2/imu/data_raw: 10 messages of session.mcap, made from 1.900 s to 1.990 s, are missing from other.mcap"
    )
    assert missing in list(result.lines())
    assert compare(recording, other, {"/tt2/template"}).identical


def test_a_broken_recording_is_not_the_same(tmp_path: Path, recording: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(recording.read_bytes()[:-20])
    result = compare(recording, cut)
    assert not result.same
    assert next(result.lines()) == f"{cut}: broken off, or still being written"
