"""``touchline salvage`` writes a sound file of whatever can be read, and says what cannot."""

import json
from collections.abc import Iterator
from itertools import takewhile
from pathlib import Path

import pytest
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Channel, DataEnd, McapRecord, SummaryOffset
from mcap.stream_reader import StreamReader
from mcap.writer import Writer
from typer.testing import CliRunner

from tests.bridge.foreign import foreign
from tests.bridge.mutations import mutated, records
from tests.bridge.said import messages, record, sent
from tests.command import app
from touchline.recordings.compare import compare
from touchline.recordings.reader import RecordingReader, read_summary
from touchline.recordings.recorder import CHUNK_BYTES
from touchline.recordings.salvage import salvage
from touchline.schemas.cdr import encode
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import String

SAID = [("/a", number * 10**9, encode(String(data="x" * 400))) for number in range(1, 21)]


def salvaged(source: Path, out: Path) -> tuple[int, dict]:
    result = CliRunner().invoke(app, ["salvage", str(source), str(out), "--json"], catch_exceptions=False)
    return result.exit_code, json.loads(result.stdout)


def test_a_recording_without_its_end_comes_through_with_an_index(tmp_path: Path) -> None:
    recorder = record(tmp_path / "a.mcap", messages(300))
    recorder.flush()  # and then kill -9
    code, figures = salvaged(tmp_path / "a.mcap", tmp_path / "b.mcap")
    held = read_summary(tmp_path / "b.mcap")
    assert (code, figures["lost"], held.complete, held.problem) == (0, 0, True, "")
    with (tmp_path / "b.mcap").open("rb") as stream:  # another reader, which needs the index
        summary = make_reader(stream).get_summary()
    assert summary is not None and summary.statistics is not None and summary.chunk_indexes
    assert summary.statistics.message_count == held.messages == figures["messages"] and sent(held) == recorder.messages
    qos = {channel.topic: channel.metadata for channel in summary.channels.values()}
    assert "reliability" in qos["/tt2/imu/data_raw"]["offered_qos_profiles"]
    result = compare(tmp_path / "a.mcap", tmp_path / "b.mcap")
    assert all(topic.same for topic in result.topics.values())


def test_every_group_that_the_salvaged_file_refers_to_is_there(tmp_path: Path) -> None:
    salvaged(foreign(tmp_path / "a.mcap", SAID), tmp_path / "b.mcap")  # without any attachment
    with (tmp_path / "b.mcap").open("rb") as stream:
        offsets = [found for found in StreamReader(stream).records if isinstance(found, SummaryOffset)]
    assert Opcode.ATTACHMENT_INDEX in {offset.group_opcode for offset in offsets}
    assert all(offset.group_length > 0 for offset in offsets)


def test_channels_without_messages_are_in_the_data_wherever_the_last_chunk_ends(tmp_path: Path) -> None:
    source, out = tmp_path / "a.mcap", tmp_path / "b.mcap"
    with source.open("wb") as file:
        writer = Writer(file, use_chunking=False)
        writer.start("ros2", "somebody")
        _, told = (writer.register_channel(topic, "cdr", 0) for topic in ("/silent", "/told"))
        for number in range(3):
            writer.add_message(told, number, bytes(CHUNK_BYTES), number)  # a chunk each
        writer.finish()
    assert salvage(source, out).messages == 3
    with out.open("rb") as file:
        in_data = {record.topic for record in _until_data_end(StreamReader(file)) if isinstance(record, Channel)}
    assert in_data == {"/silent", "/told"} == set(read_summary(out).topics)


def _until_data_end(reader: StreamReader) -> Iterator[McapRecord]:
    return takewhile(lambda record: not isinstance(record, DataEnd), reader.records)


def test_what_is_lost_is_told_with_its_place_and_time(tmp_path: Path) -> None:
    path = foreign(tmp_path / "a.mcap", SAID)
    data = bytearray(path.read_bytes())
    start, end = [place for place in records(bytes(data)) if data[place[0]] == Opcode.CHUNK][2]
    data[end - 8] ^= 0xFF
    path.write_bytes(data)
    code, figures = salvaged(path, tmp_path / "b.mcap")
    (loss,) = figures["losses"]
    assert code == 1 and figures["lost"] == loss["messages"] == 20 - figures["messages"] > 0
    assert f"at byte {start:,}" in loss["what"] and loss["from_ns"] >= 10**9
    told = read_summary(tmp_path / "b.mcap").metadata["touchline_salvaged"]
    assert told["lost"] == str(loss["messages"]) and f"at byte {start:,}" in told["loss_1"]


def test_a_record_that_is_cut_is_a_loss(tmp_path: Path) -> None:
    path = foreign(tmp_path / "a.mcap", SAID)
    data = path.read_bytes()
    _, end = [place for place in records(data) if data[place[0]] == Opcode.CHUNK][-1]
    path.write_bytes(data[: end - 5])
    code, figures = salvaged(path, tmp_path / "b.mcap")
    assert code == 1 and figures["lost"] is None and "the last message is of" in figures["ending"]


def test_metadata_attachments_and_schemas_that_are_no_text_are_kept(tmp_path: Path) -> None:
    path, schema = tmp_path / "a.mcap", bytes(range(256))
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("other", "another")
        channel = writer.register_channel("/p", "protobuf", writer.register_schema("x.Y", "protobuf", schema))
        writer.register_channel("/silent", "json", 0, {"why": "never said"})
        writer.add_message(channel, 7, b"\x01\x02", 5, 3)
        writer.add_attachment(1, 2, "notes.txt", "text/plain", b"hello")
        writer.add_metadata("who", {"name": "Kim"})
        writer.finish()
    assert salvaged(path, tmp_path / "b.mcap")[0] == 0
    with (tmp_path / "b.mcap").open("rb") as stream:
        reader = make_reader(stream)
        found = [(s.data, c.topic, m.log_time, m.publish_time, m.sequence) for s, c, m in reader.iter_messages() if s]
        assert found == [(schema, "/p", 7, 5, 3)]
        (attached,) = reader.iter_attachments()
        assert (attached.name, attached.media_type, attached.data, attached.create_time) == (
            "notes.txt",
            "text/plain",
            b"hello",
            1,
        )
        assert {each.name: each.metadata for each in reader.iter_metadata()}["who"] == {"name": "Kim"}
        summary = reader.get_summary()
        assert summary is not None and reader.get_header().profile == "other"
        assert {c.topic: c.metadata for c in summary.channels.values()}["/silent"] == {"why": "never said"}


def test_a_damaged_attachment_is_left_out_and_told(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("", "another")
        writer.add_attachment(1, 2, "notes.txt", "text/plain", b"hello")
        writer.finish()
    path.write_bytes(path.read_bytes().replace(b"hello", b"hallo", 1))
    code, figures = salvaged(path, tmp_path / "b.mcap")
    assert code == 1 and figures["attachments"] == 0
    assert "'notes.txt', whose checksum is wrong" in figures["losses"][0]["what"]


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    path = foreign(tmp_path / "a.mcap", SAID)
    before = path.read_bytes()
    for out in (path, foreign(tmp_path / "b.mcap", SAID[:2])):
        result = CliRunner().invoke(app, ["salvage", str(path), str(out)])
        assert isinstance(result.exception, TouchlineError) and "is there already" in str(result.exception)
    assert path.read_bytes() == before
    (tmp_path / "c.mcap").write_text("no")
    with pytest.raises(TouchlineError, match="is not an MCAP"):
        salvage(tmp_path / "c.mcap", tmp_path / "d.mcap")
    assert not (tmp_path / "d.mcap").exists()


def test_of_whatever_damage_a_sound_file_is_made_or_one_line_says_why_not(tmp_path: Path) -> None:
    data = foreign(tmp_path / "a.mcap", SAID).read_bytes()
    path, refused = tmp_path / "damaged.mcap", 0
    for number in range(60):
        path.write_bytes(mutated(data, number))
        out = tmp_path / f"{number}.mcap"
        try:
            found = salvage(path, out)
        except TouchlineError as error:
            refused += 1
            assert "\n" not in str(error) and not out.exists()
            continue
        held = read_summary(out)
        assert held.complete and held.problem == "" and held.messages == found.messages
        read = [message.payload for message in RecordingReader(path).messages()]
        assert [message.payload for message in RecordingReader(out).messages()] == read
    assert refused < 30
