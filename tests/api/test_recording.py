"""Recordings of anybody as arrays."""

import math
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer
from mcap_ros2.writer import Writer as Ros2Writer

import touchline

SESSION = Path(__file__).parents[2] / "examples" / "sessions" / "square.mcap"


@pytest.fixture(scope="module")
def session() -> touchline.Recording:
    return touchline.Recording(SESSION)


def test_every_topic_becomes_an_array_with_all_its_messages(session: touchline.Recording) -> None:
    assert session.robots == ("tt2",) and session.problem == "" and session.duration_s > 1.0
    for name, topic in session.topics.items():
        array = session[name].array()
        assert len(array) == topic.messages, name
        assert array.dtype.names[:2] == ("time_s", "log_time_s")


def test_columns_are_what_the_messages_say_one_by_one(session: touchline.Recording) -> None:
    series = session["imu/data_raw"]
    array, messages = series.array(), list(series.messages())
    assert len(array) == len(messages) == len(series)
    for number in (0, 7, len(messages) - 1):
        time_s, message = messages[number]
        assert array["time_s"][number] == time_s
        assert array["linear_acceleration.z"][number] == message.linear_acceleration.z
        assert array["header.frame_id"][number] == message.header.frame_id
        assert (array["orientation_covariance"][number] == message.orientation_covariance).all()


def test_messages_of_different_length_are_decoded_one_by_one(session: touchline.Recording) -> None:
    statuses = session["traversal/status"].array()
    assert statuses["arc_length_m"][-1] > 1.0
    assert isinstance(statuses["painted_fraction"][-1], list)
    assert set(statuses["segment_id"]) > {""}


def test_topics_are_joined_by_the_last_value_until_then(session: touchline.Recording) -> None:
    rows = session.frame(["odometry/filtered", "gnss/fix"], kind="numpy")
    fixes = session["gnss/fix"].array()
    for row in rows[:: max(len(rows) // 20, 1)]:
        until = fixes[fixes["time_s"] <= row["time_s"]]
        if len(until):
            assert row["gnss/fix.latitude"] == until["latitude"][-1]
        else:
            assert math.isnan(row["gnss/fix.latitude"])


def test_an_unknown_topic_is_named_with_the_one_that_is_meant(session: touchline.Recording) -> None:
    with pytest.raises(touchline.SpecError, match="did you mean '/tt2/imu/data_raw'"):
        session["imu/data"]
    with pytest.raises(touchline.RecordingError):
        touchline.Recording(SESSION.with_name("none.mcap"))


def test_a_recording_of_another_writer_is_read_by_its_own_schemas(tmp_path: Path) -> None:
    path = tmp_path / "other.mcap"
    with path.open("wb") as stream, Ros2Writer(stream) as writer:
        schema = writer.register_msgdef(
            "other_msgs/msg/Reading", "string label\nfloat32 value\nint16[3] raw\nuint8[] more"
        )
        for number in range(50):
            message = {
                "label": "a" * (1 + number % 2),
                "value": number / 2,
                "raw": [number, 1, 2],
                "more": [1] * (number % 3),
            }
            writer.write_message("/reading", schema, message, log_time=number * 10**9, publish_time=number * 10**9)
        for number in range(20):
            message = {"label": "same", "value": number / 2, "raw": [number, 1, 2], "more": [7, 8]}
            writer.write_message("/fixed", schema, message, log_time=number * 10**9, publish_time=number * 10**9)
    recording = touchline.Recording(path)
    varying, fixed = recording["/reading"].array(), recording["/fixed"].array()
    assert varying["value"].tolist() == [number / 2 for number in range(50)]
    assert varying["label"].tolist() == ["a" * (1 + number % 2) for number in range(50)]
    assert fixed["raw"].tolist() == [[number, 1, 2] for number in range(20)]
    assert fixed["more"].tolist() == [[7, 8]] * 20 and set(fixed["label"]) == {"same"}


def test_json_is_read_too(tmp_path: Path) -> None:
    path = tmp_path / "json.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("point", "jsonschema", b"{}")
        channel = writer.register_channel("/point", "json", schema)
        for number in range(3):
            writer.add_message(channel, number * 10**9, b'{"x": %d, "y": null, "time_s": 7}' % number, number * 10**9)
        writer.finish()
    array = touchline.Recording(path)["/point"].array()
    assert array["x"].tolist() == [0, 1, 2]
    assert np.array_equal(array["time_s"], [0.0, 1.0, 2.0])
    assert array["message.time_s"].tolist() == [7, 7, 7]
