"""``touchline info`` on whole, damaged and foreign recordings."""

import json
from pathlib import Path

import pytest
from mcap.opcode import Opcode
from mcap.writer import Writer
from typer.testing import CliRunner

from tests.bridge.foreign import foreign
from tests.bridge.mutations import records
from tests.bridge.said import messages, record
from tests.command import app
from touchline.schemas.cdr import encode
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import String


def told(path: Path) -> dict:
    result = CliRunner().invoke(app, ["info", str(path), "--json"], catch_exceptions=False)
    assert result.exit_code == 0
    return json.loads(result.stdout)


def test_figures_of_a_session(tmp_path: Path) -> None:
    found = told(record(tmp_path / "a.mcap", messages(200)).finish().path)
    imu = found["topics"]["/tt2/imu/data_raw"]
    assert (imu["type"], imu["encoding"], imu["messages"]) == ("sensor_msgs/msg/Imu", "cdr", 200)
    assert imu["rate_hz"] == pytest.approx(100.0)
    assert found["sim_time_s"] == {"from": 0.0, "to": 1.99} and found["duration_s"] == pytest.approx(1.99)
    assert found["robots"] == ["tt2"] and found["complete"] and found["wall_time"] is None
    assert found["metadata"]["touchline_lost"] == {"total": "0"}
    shown = CliRunner().invoke(app, ["info", str(tmp_path / "a.mcap")]).stdout
    assert "/tt2/imu/data_raw" in shown and "sensor_msgs/msg/Imu" in shown


def test_a_recorder_with_a_wall_clock_and_an_attachment(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "another")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        channel = writer.register_channel("/text", "cdr", schema)
        writer.add_message(channel, 1_700_000_000_000_000_000, encode(String(data="a")), 0)
        writer.add_attachment(1, 2, "notes.txt", "text/plain", b"hello")
        writer.finish()
    found = told(path)
    assert found["wall_time"]["begun"] == "2023-11-14T22:13:20.000+00:00" and found["sim_time_s"] is None
    assert found["attachments"] == [{"name": "notes.txt", "media_type": "text/plain", "bytes": 5, "file": "a.mcap"}]
    assert found["robots"] == [] and found["complete"]


def test_a_bad_chunk_and_its_losses_are_told(tmp_path: Path) -> None:
    said = [("/a", number * 10**9, encode(String(data="x" * 400))) for number in range(20)]
    path = foreign(tmp_path / "a.mcap", said)
    data = bytearray(path.read_bytes())
    start, end = [place for place in records(bytes(data)) if data[place[0]] == Opcode.CHUNK][2]
    data[end - 8] ^= 0xFF
    path.write_bytes(data)
    found = told(path)
    (loss,) = found["files"][0]["losses"]
    assert not found["complete"] and loss["messages"] == 20 - found["messages"] > 0
    assert f"at byte {start:,}" in loss["what"] and 0 < loss["from_s"] <= loss["to_s"]


def test_what_is_no_recording_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_text("no")
    result = CliRunner().invoke(app, ["info", str(tmp_path / "a.mcap")])
    assert isinstance(result.exception, TouchlineError) and "is not an MCAP recording" in str(result.exception)
