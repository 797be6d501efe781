"""Whatever a file holds, every reader of recordings gives an answer or one line that says why not."""

import os
import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import lz4.frame
import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk
from mcap.writer import MCAP0_MAGIC, CompressionType, Writer

from tests.bridge.foreign import foreign
from tests.bridge.mutations import mutated, records
from tests.bridge.said import messages, stamp
from tests.painted import read_painted
from touchline.recordings.channels import kind_of
from touchline.recordings.compare import compare
from touchline.recordings.mcap_file import LARGEST_RATIO
from touchline.recordings.reader import read_summary
from touchline.recordings.recorder import Recorder
from touchline.recordings.recording_file import RecordingError
from touchline.recordings.replay.replayer import Timeline
from touchline.recordings.unpack import LARGEST_CHUNK_BYTES
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import Clock, Imu, PaintMarks, String, TraversalReport

TEMPLATE = '{"name": "t", "segments": [{"id": "a", "line": {"start": [0, 0], "end": [5, 0]}}]}'
MUTATED = 80


def painted_session(path: Path, compression: CompressionType) -> Path:
    """A small job: a template, its paint and the report, in chunks small enough for each to matter."""
    said = [(topic, encode(message)) for topic, message in messages(60) if topic is not topics.TEMPLATE]
    said = [(topics.TEMPLATE, encode(String(data=TEMPLATE))), *said, (topics.REPORT, encode(TraversalReport()))]
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=2048, compression=compression)
        writer.start("ros2", "another recorder")
        channels = {}
        for topic in dict.fromkeys(topic for topic, _ in said):
            schema = writer.register_schema(topic.type.ros_type, "ros2msg", kind_of(topic.type).schema.encode())
            channels[topic.name] = writer.register_channel(f"/tt2/{topic.name}", "cdr", schema)
        for number, (topic, payload) in enumerate(said):
            writer.add_message(channels[topic.name], number * 10_000_000, payload, 0, number)
        writer.add_metadata("touchline_lost", {"total": "0"})
        writer.finish()
    assert read_summary(path).problem == ""
    assert len(read_painted(path).strokes) > 0
    return path


@pytest.mark.parametrize("compression", [CompressionType.NONE, CompressionType.ZSTD, CompressionType.LZ4])
def test_a_mutated_recording_gives_an_answer_or_one_line(tmp_path: Path, compression: CompressionType) -> None:
    original = painted_session(tmp_path / "original.mcap", compression)
    path, data = tmp_path / "mutated.mcap", original.read_bytes()
    readers: tuple[Callable[[], object], ...] = (
        lambda: read_summary(path),
        lambda: list(compare(original, path).lines()),
        lambda: [cue.at_s for cue in Timeline(path).cues()],
        lambda: read_painted(path),
    )
    outcomes = [0, 0]
    for number in range(MUTATED):
        path.write_bytes(mutated(data, number))
        for read in readers:
            try:
                read()
            except TouchlineError as error:
                outcomes[1] += 1
                assert "\n" not in str(error) and str(error), number
            else:
                outcomes[0] += 1
    assert min(outcomes) > MUTATED / 10  # both kinds of file are among them


def file_of(*chunks: Chunk) -> bytes:
    builder = RecordBuilder()
    builder.write(MCAP0_MAGIC)
    for chunk in chunks:
        chunk.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]


def chunk_of(body: bytes, compression: str, packed: bytes, claimed: int | None = None, crc: int | None = None) -> Chunk:
    size = len(body) if claimed is None else claimed
    checksum = zlib.crc32(body) if crc is None else crc
    return Chunk(compression, packed, 0, 0, checksum, size)


ZEROS = bytes(LARGEST_CHUNK_BYTES + 1)
PACK = {"zstd": zstandard.ZstdCompressor().compress, "lz4": lz4.frame.compress}


@pytest.mark.parametrize("compression", PACK)
@pytest.mark.parametrize("claimed", [LARGEST_CHUNK_BYTES + 1, 2**63, 1000, 0])
def test_a_small_chunk_that_would_become_large_is_not_unpacked(tmp_path: Path, compression: str, claimed: int) -> None:
    path = tmp_path / "bomb.mcap"
    path.write_bytes(file_of(chunk_of(ZEROS, compression, PACK[compression](ZEROS), claimed)))
    assert path.stat().st_size < 300_000
    limit = f"at most {LARGEST_CHUNK_BYTES:,} are unpacked"
    assert (limit if claimed > LARGEST_CHUNK_BYTES else "does not unpack to") in read_summary(path).problem


def test_many_small_bombs_are_one(tmp_path: Path) -> None:
    body = b"\x0f" + struct.pack("<Q", 20_000_000) + bytes(20_000_000)
    chunk = chunk_of(body, "zstd", PACK["zstd"](body))
    path = tmp_path / "bombs.mcap"
    path.write_bytes(file_of(*[chunk] * 100))
    assert f"{LARGEST_RATIO} times what they take" in read_summary(path).problem


@pytest.mark.parametrize(
    ("chunk", "problem"),
    [
        (chunk_of(b"abc", "zstd", b"junk"), "cannot be unpacked"),
        (chunk_of(b"abc", "lz4", b"junk" * 10), "cannot be unpacked"),
        (chunk_of(b"abc", "rar", b"abc"), "unknown compression"),
        (chunk_of(b"abc", "", b"abc", crc=1), "checksum is wrong"),
        (chunk_of(b"", "", b"\x05" + struct.pack("<Q", 2**40)), "does not unpack"),
        (chunk_of(bad := b"\x05" + struct.pack("<Q", 2**40), "", bad), "beyond its chunk"),
        (chunk_of(bad := b"\x05" + struct.pack("<Q", 3) + b"abc", "", bad), "without its head"),
        (chunk_of(bad := b"\x05" + struct.pack("<Q", 22) + bytes(22), "", bad), "unknown channel"),
        (chunk_of(bad := b"\x04" + struct.pack("<Q", 3) + b"abc", "", bad), "channel record that cannot be read"),
    ],
)
def test_what_is_wrong_with_a_chunk_is_said(tmp_path: Path, chunk: Chunk, problem: str) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(file_of(chunk))
    assert problem in read_summary(path).problem


def test_a_topic_whose_name_is_a_book_is_refused(tmp_path: Path) -> None:
    builder = RecordBuilder()
    Channel(0, "/x" * 1_000_000, "cdr", {}, 0).write(builder)
    body = bytes(builder.end())  # type: ignore[no-untyped-call]
    path = tmp_path / "a.mcap"
    path.write_bytes(file_of(chunk_of(body, "", body)))
    assert "at most 1,000 are read" in read_summary(path).problem


@pytest.mark.parametrize("opcode", [0x00, 0x07, 0x0F, 0x46, 0x90])
def test_a_chunk_that_is_passed_over_is_told_and_its_messages_are_counted(tmp_path: Path, opcode: int) -> None:
    path = painted_session(tmp_path / "a.mcap", CompressionType.ZSTD)
    whole, data = read_summary(path).messages, bytearray(path.read_bytes())
    start, _ = [place for place in records(bytes(data)) if data[place[0]] == Opcode.CHUNK][3]
    data[start] = opcode
    path.write_bytes(data)
    held = read_summary(path)
    (loss,) = held.losses
    assert loss.messages == whole - held.messages > 0
    assert ("no known kind" if opcode in (0x00, 0x46) else "should have") in held.problem


def test_what_stands_behind_the_end_of_a_file_is_told(tmp_path: Path) -> None:
    path = painted_session(tmp_path / "a.mcap", CompressionType.ZSTD)
    path.write_bytes(path.read_bytes() * 2)
    assert "bytes behind the end of a.mcap" in read_summary(path).problem


@pytest.mark.parametrize("length", [3, 2**20, 2**40])
def test_a_bad_length_costs_a_file_without_chunks_no_more_than_its_record(tmp_path: Path, length: int) -> None:
    said = [("/a", number * 10**9, encode(String(data=f"{number}"))) for number in range(20)]
    path = foreign(tmp_path / "a.mcap", said, chunked=False)
    data = bytearray(path.read_bytes())
    start, _ = [place for place in records(bytes(data)) if data[place[0]] == Opcode.MESSAGE][4]
    struct.pack_into("<Q", data, start + 1, length)
    path.write_bytes(data)
    held = read_summary(path)
    assert held.messages == 19 and held.complete
    assert held.problem.startswith("1 message is lost")


def test_links_and_long_names_are_read(tmp_path: Path) -> None:
    name = "/" + "x" * 300
    path = foreign(tmp_path / "a.mcap", [(name, 5, encode(String()))])
    link = tmp_path / "link.mcap"
    link.symlink_to(path)
    assert list(read_summary(link).topics) == [name] and compare(link, path).identical


def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.mcap")
    for path in (tmp_path / "pipe.mcap", Path("/dev/zero"), tmp_path):
        with pytest.raises(RecordingError, match="it is no file"):
            read_summary(path)


def test_a_replay_passes_over_what_no_one_could_read_and_waits_for_no_century(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.mcap")
    recorder.write("clock", encode(Clock(clock=stamp(100))), 1)
    recorder.write("imu/data_raw", encode(Imu())[:-9], 2)
    recorder.write("clock", encode(Clock(clock=stamp(100 * 86_401 * 100))), 3)
    recorder.write("clock", encode(Clock(clock=stamp(150))), 4)
    timeline = Timeline(recorder.finish().path)
    assert [cue.at_s for cue in timeline.cues()] == [0.0, 0.0, 0.0]
    assert timeline.skipped == 1


@pytest.mark.parametrize(
    "marks",
    [
        PaintMarks(x_m=[0.0, 1.0], y_m=[0.0]),
        PaintMarks(x_m=[0.0, float("nan")], y_m=[0.0, 1.0]),
        PaintMarks(x_m=[0.0, 1e30], y_m=[0.0, 1.0]),
        PaintMarks(x_m=[0.0, 1.0], y_m=[0.0, 1.0], width_m=float("inf")),
    ],
    ids=["lengths", "nan", "far", "wide"],
)
def test_marks_that_no_robot_made_are_not_drawn(tmp_path: Path, marks: PaintMarks) -> None:
    recorder = Recorder(tmp_path / "a.mcap")
    recorder.write("template", encode(String(data=TEMPLATE)), 1)
    recorder.write("truth/paint", encode(marks), 1)
    with pytest.raises(TouchlineError, match="impossible marks"):
        read_painted(recorder.finish().path)
