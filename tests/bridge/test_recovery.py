"""A damaged recording gives all that is whole in it, and says how much is lost and where."""

import struct
from pathlib import Path

import pytest
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel
from mcap.writer import CompressionType, IndexType, Writer

from tests.bridge.foreign import foreign
from tests.bridge.mutations import records
from touchline.recordings.compare import compare
from touchline.recordings.reader import read_summary
from touchline.recordings.recording_file import RecordingError
from touchline.schemas.cdr import encode
from touchline.schemas.messages import String


def of_kind(data: bytes, opcode: int) -> list[tuple[int, int]]:
    return [place for place in records(data) if data[place[0]] == opcode]


@pytest.fixture
def session(tmp_path: Path) -> Path:
    """100 messages in about 50 chunks."""
    said = (("/a", n * 10**9, encode(String(data=f"{n}" * 60))) for n in range(100))
    return foreign(tmp_path / "a.mcap", said, chunk_bytes=300)


def in_chunks(data: bytes) -> list[int]:
    """Messages of each chunk, by their indexes."""
    return [(end - start - 9 - 6) // 16 for start, end in of_kind(data, Opcode.MESSAGE_INDEX)]


@pytest.mark.parametrize("spoilt", [0, 20, -1])
def test_one_bad_chunk_costs_its_own_messages_and_no_more(session: Path, spoilt: int) -> None:
    data = bytearray(session.read_bytes())
    chunks, held = of_kind(data, Opcode.CHUNK), in_chunks(data)
    assert len(chunks) > 40
    start, end = chunks[spoilt]
    data[end - 3] ^= 0x10
    session.write_bytes(data)
    summary = read_summary(session)
    assert summary.messages == 100 - held[spoilt]
    (loss,) = summary.losses
    assert loss.messages == held[spoilt]
    first = sum(held[:spoilt]) if spoilt >= 0 else 100 - held[-1]
    assert (loss.from_ns, loss.to_ns) == (first * 10**9, (first + held[spoilt] - 1) * 10**9)
    assert f"at byte {start:,} of a.mcap" in summary.problem and summary.ending == ""


@pytest.mark.parametrize("length", [0, 5, 10**4, 2**33, 2**64 - 1])
def test_a_wrong_length_costs_one_chunk(session: Path, length: int) -> None:
    data = bytearray(session.read_bytes())
    struct.pack_into("<Q", data, of_kind(data, Opcode.CHUNK)[10][0] + 1, length)
    lost = in_chunks(session.read_bytes())[10]
    session.write_bytes(data)
    summary = read_summary(session)
    if length == 10**4:  # all that is in the chunk can be told by its own fields
        assert (summary.messages, summary.problem) == (100, "")
    else:
        assert summary.messages == 100 - lost and "lost" in summary.problem
        assert not compare(session, session).same


def test_a_hole_in_the_file_costs_what_was_in_it(session: Path) -> None:
    data = session.read_bytes()
    chunks, held = of_kind(data, Opcode.CHUNK), in_chunks(data)
    session.write_bytes(data[: chunks[10][0] + 20] + data[chunks[14][0] + 5 :])
    assert read_summary(session).messages == 100 - sum(held[10:15])


def test_a_channel_whose_chunk_is_bad_is_known_from_the_index(session: Path) -> None:
    data = bytearray(session.read_bytes())
    data[of_kind(data, Opcode.CHUNK)[0][1] - 2] ^= 0xFF  # the first one, which defines the topic
    session.write_bytes(data)
    summary = read_summary(session)
    assert summary.messages == 100 - in_chunks(data)[0]
    assert summary.topics["/a"].ros_type == "std_msgs/msg/String"


def unchunked(path: Path, messages_of: tuple[int, ...]) -> Path:
    with path.open("wb") as stream:
        writer = Writer(stream, use_chunking=False, index_types=IndexType.NONE, compression=CompressionType.NONE)
        writer.start("", "another")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        writer.register_channel("/a", "cdr", schema)
        for number, channel in enumerate(messages_of):
            writer.add_message(channel, number, encode(String(data="x")), number, number)
        writer.finish()
    return path


def test_messages_of_unknown_channels_are_counted_and_the_others_read(tmp_path: Path) -> None:
    summary = read_summary(unchunked(tmp_path / "a.mcap", (1, 9, 1, 9, 1)))
    assert summary.messages == 3
    assert summary.problem.startswith("2 messages are lost (of the unknown channel 9")


def test_a_spoilt_message_outside_of_chunks_costs_itself(tmp_path: Path) -> None:
    path = unchunked(tmp_path / "a.mcap", (1,) * 10)
    builder = RecordBuilder()
    Channel(5, "", "", {}, 0).write(builder)
    short = bytes([Opcode.MESSAGE]) + struct.pack("<Q", 3) + b"abc"
    data = path.read_bytes()
    at = of_kind(data, Opcode.MESSAGE)[4][0]
    path.write_bytes(data[:at] + short + data[at:])
    summary = read_summary(path)
    assert (summary.messages, summary.losses[0].messages) == (10, 1)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("lfs.mcap", b"version https://git-lfs.github.com/spec/v1\noid", "git lfs pull"),
        ("old.bag", b"#ROSBAG V2.0\n", "rosbags-convert"),
        ("empty.mcap", b"", "is not an MCAP recording"),
        ("words.mcap", b"not a recording, but long enough for a header", "is not an MCAP recording"),
        ("x" * 300 + ".mcap", None, "File name too long"),
    ],
    ids=["lfs", "ros1", "empty", "words", "long"],
)
def test_what_is_no_recording_is_told_in_a_line(tmp_path: Path, name: str, content: bytes | None, said: str) -> None:
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(RecordingError, match=said):
        read_summary(path)


def test_a_link_to_nowhere_is_told_in_a_line(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").symlink_to(tmp_path / "gone.mcap")
    with pytest.raises(RecordingError, match="No such file"):
        read_summary(tmp_path / "a.mcap")
