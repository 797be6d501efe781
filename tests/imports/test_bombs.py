"""Small files that unfold to much, or never end: each is refused in a line, or gives what is sound in it."""

import bz2
import sqlite3
import struct
from pathlib import Path

import pytest
from lz4 import frame
from mcap.writer import CompressionType, Writer

from touchline.checking.importing.limited_reader import ReadingLimits, read_limited
from touchline.recordings.decoding import layout
from touchline.recordings.logs.formats import read_logs
from touchline.recordings.logs.log_table import LogError
from touchline.recordings.recorded import RecordingKind
from touchline.recordings.recording_file import RecordingError
from touchline.recordings.rosbag2 import bag_files

CHUNK = 60_000_000
IMU = "std_msgs/Header header\nfloat64 x\n"


def fields(**values: bytes) -> bytes:
    parts = [name.encode() + b"=" + value for name, value in values.items()]
    return b"".join(struct.pack("<I", len(part)) + part for part in parts)


def record(data: bytes, **header: bytes) -> bytes:
    head = fields(**header)
    return struct.pack("<I", len(head)) + head + struct.pack("<I", len(data)) + data


def ros1_bag(path: Path, compression: str, chunks: list[tuple[int, bytes]]) -> Path:
    """A ROS 1 bag with chunks of (claimed size, packed data)."""
    told = fields(topic=b"/a", type=b"a/A", md5sum=b"*", message_definition=b"float64 x\n")
    connection = record(told, op=b"\x07", conn=struct.pack("<I", 0), topic=b"/a")
    body = b"#ROSBAG V2.0\n" + connection
    for size, packed in chunks:
        body += record(packed, op=b"\x05", compression=compression.encode(), size=struct.pack("<I", size))
    path.write_bytes(body)
    return path


def told_of(path: Path) -> str:
    """Output about a log, in whichever way that comes."""
    try:
        _, content = read_logs([path])
    except LogError as error:
        assert "\n" not in str(error)
        assert path.name in str(error)
        return str(error)
    return "; ".join(content.problems)


@pytest.mark.parametrize(
    ("compression", "pack"),
    [("bz2", bz2.compress), ("lz4", frame.compress), ("none", bytes)],
    ids=["bz2", "lz4", "none"],
)
def test_chunks_of_a_ros1_bag_unpack_to_no_more_than_they_may(tmp_path, compression, pack):
    message = record(b"", op=b"\x02", conn=bytes(4), time=bytes(8))
    size = CHUNK if compression != "none" else 1000
    packed = pack(record(bytes(size - len(message)), op=b"\x02", conn=bytes(4), time=bytes(8)))
    path = ros1_bag(tmp_path / "many.bag", compression, [(CHUNK, packed)] * 8)
    told = told_of(path)
    assert "chunks that hold more than" in told or "does not unpack to the 60,000,000 bytes that it claims" in told
    assert "a chunk of 4,000,000,000 bytes" in told_of(
        ros1_bag(tmp_path / "large.bag", compression, [(4 * 10**9, packed)])
    )
    assert "does not unpack to the 10 bytes" in told_of(ros1_bag(tmp_path / "more.bag", compression, [(10, packed)]))


def test_a_record_that_claims_more_than_there_is_is_not_allocated(tmp_path):
    path = tmp_path / "claims.bag"
    path.write_bytes(b"#ROSBAG V2.0\n" + struct.pack("<I", 0xFFFFFFF0) + b"x")
    assert "a record of 4,294,967,280 bytes" in told_of(path)


MESSAGES = "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)"
TOPICS = "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)"
ENDLESS = "WITH RECURSIVE c(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM c)"
NUMBERS = "SELECT i AS id, 1 AS topic_id, i AS timestamp, zeroblob(60000000) AS data FROM c"


@pytest.mark.parametrize(
    "schema",
    [
        [f"CREATE VIEW messages AS {ENDLESS} {NUMBERS}", TOPICS],
        [MESSAGES, f"CREATE VIEW topics AS {ENDLESS} SELECT i AS id, 'a', 'b', 'cdr' FROM c"],
        [MESSAGES.replace("data BLOB", "data BLOB AS (zeroblob(60000000))"), TOPICS],
        ["CREATE VIRTUAL TABLE messages USING fts5(topic_id, timestamp, data)", TOPICS],
        [
            MESSAGES,
            TOPICS.replace("serialization_format TEXT", "serialization_format TEXT AS (hex(zeroblob(9999999)))"),
        ],
    ],
)
def test_tables_of_a_bag_that_compute_what_they_give_are_refused(tmp_path, schema):
    path = tmp_path / "bag.db3"
    with sqlite3.connect(path) as database:
        for statement in schema:
            database.execute(statement)
        for i in range(20):
            if "AS (zeroblob" in schema[0]:
                database.execute("INSERT INTO messages(id, topic_id, timestamp) VALUES (?, 1, 1)", (i,))
    database.close()
    assert "no plain table" in told_of(path)


def test_a_view_of_definitions_is_not_asked(tmp_path):
    path = tmp_path / "bag.db3"
    with sqlite3.connect(path) as database:
        for statement in (MESSAGES, TOPICS, f"CREATE VIEW message_definitions AS {ENDLESS} {NUMBERS}"):
            database.execute(statement)
    database.close()
    assert told_of(path) == ""


def test_a_tree_of_pages_that_leads_in_circles_has_an_end(tmp_path):
    """Inner pages of the table whose every child is one page: a hundred to the third rows of few bytes."""
    path = tmp_path / "bag.db3"
    with sqlite3.connect(path) as database:
        database.execute(MESSAGES)
        database.execute(TOPICS)
        database.execute("INSERT INTO topics VALUES (1, '/a', 'a/A', 'cdr')")
        database.executemany(
            "INSERT INTO messages VALUES (?, 1, 1, ?)", [(i, bytes(3000)) for i in range(1, 200_000, 9)]
        )
        (root,) = database.execute("SELECT rootpage FROM sqlite_master WHERE name = 'messages'").fetchone()
        (page_bytes,) = database.execute("PRAGMA page_size").fetchone()
    database.close()
    data = bytearray(path.read_bytes())

    def children(page: int) -> list[int]:
        """Places of the numbers of the children; none in a leaf."""
        at = (page - 1) * page_bytes
        if data[at] != 5:
            return []
        (cells,) = struct.unpack_from(">H", data, at + 3)
        return [at + cell for cell in struct.unpack_from(f">{cells}H", data, at + 12)]

    inner = next(struct.unpack_from(">I", data, at)[0] for at in children(root))
    for at in children(root):
        data[at : at + 4] = struct.pack(">I", inner)
    leaf = struct.unpack_from(">I", data, children(inner)[0])[0]
    for at in children(inner):
        data[at : at + 4] = struct.pack(">I", leaf)
    path.write_bytes(data[: (max(root, inner, leaf) + 2) * page_bytes])
    told_of(path)


def test_chunks_of_mcap_unpack_to_no_more_than_they_may(tmp_path):
    path = tmp_path / "many.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=CHUNK, compression=CompressionType.ZSTD)
        writer.start()
        schema = writer.register_schema("a/A", "ros1msg", b"float64 x\n")
        channel = writer.register_channel("/a", "ros1", schema)
        for i in range(5):
            writer.add_message(channel, i, bytes(CHUNK // 2 + 1), i)
        writer.finish()
    assert path.stat().st_size < 100_000
    assert "chunks that hold more than" in told_of(path)


SEPARATOR = "=" * 80 + "\n"


def nested(depth: int) -> str:
    """A type of ten fields of a type of ten fields, and so on."""
    members = [f"N{i + 1} f{j}\n" for i in range(depth) for j in range(10)]
    types = ["".join(members[10 * i : 10 * i + 10]) for i in range(depth)]
    others = [f"MSG: a/N{i}\n{text}" for i, text in enumerate(types[1:], 1)]
    return SEPARATOR.join([types[0], *others, f"MSG: a/N{depth}\nint32 x\n"])


@pytest.mark.parametrize(
    "definition",
    [
        "float64[4000000000] x\n",
        nested(12),
        "A[2] a\n",
        f"Nothing[] n\n{SEPARATOR}MSG: a/Nothing\n",
        f"Nothing[4000000000] n\nfloat64[1000001] x\n{SEPARATOR}MSG: a/Nothing\n",
        SEPARATOR.join(["N1[1000] a\n", "MSG: a/N1\nN2[1000] a\n", "MSG: a/N2\nN3[1000] a\n", "MSG: a/N3\nint8 x\n"]),
    ],
)
def test_types_that_unfold_without_end_are_not_defined(definition):
    assert layout(RecordingKind("ros1", "a/msg/A", "ros1msg", definition)) is None
    assert layout(RecordingKind("ros1", "a/msg/A", "ros1msg", nested(3))) is not None


def test_aliases_of_a_bags_metadata_are_not_unfolded(tmp_path):
    lists = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lists += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 12)]
    text = "\n".join([*lists, "rosbag2_bagfile_information: {relative_file_paths: [*a11]}"])
    (tmp_path / "metadata.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(RecordingError, match="names no relative_file_paths"):
        bag_files(tmp_path)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("claims.ubx", b"\xb5\x62\x01\x07\xf0\xff" * 20_000),
        ("claims.rtcm", b"\xd3\x03\xff\x3e\xd0\x00" * 3_000),
        ("dollars.nmea", b"$GPGGA" * 50_000),
        ("line.csv", b"time_s,x\n" + b"1" * 3_000_000),
        ("columns.csv", b"time_s" + b",x" * 2_000_000 + b"\n"),
        ("commas.csv", b"time_s,x\n" + b"," * 3_000_000),
        ("quotes.csv", b'time_s,x\n1,"' + b"\n" * 3_000_000),
        ("line.pos", b"% program\n" + b"x " * 1_000_000),
        ("log.csv.gz", b"\x1f\x8b" + bytes(100)),
        ("log.zip", b"PK\x03\x04" + bytes(100)),
    ],
    ids=lambda given: given if isinstance(given, str) else "",
)
def test_texts_and_streams_that_claim_much_end_in_a_line(tmp_path, name, content):
    path = tmp_path / name
    path.write_bytes(content)
    told = told_of(path) if name != "claims.ubx" else told_of_ubx(path)
    assert told


def told_of_ubx(path: Path) -> str:
    """One whole frame first, so that the file is taken for what it is."""
    content = path.read_bytes()
    path.write_bytes(bytes.fromhex("b56206010300 0121 02 2e54".replace(" ", "")) + content)
    return told_of(path)


def test_reading_that_takes_too_much_is_ended(tmp_path):
    path = tmp_path / "long.csv"
    path.write_text("time_s,x\n" + "1,2\n" * 2_000_000, encoding="utf-8")
    with pytest.raises(LogError, match=r"long\.csv: reading it takes more than 0 s of processor time; cut it"):
        read_limited([path], limits=ReadingLimits(10**10, 0))
    with pytest.raises(LogError, match=r"long\.csv: reading it takes more than 0\.0 GB; cut it"):
        read_limited([path], limits=ReadingLimits(5_000_000, 60))


def test_limits_are_by_the_size_of_the_logs(tmp_path):
    small, large = tmp_path / "small", tmp_path / "large"
    small.write_bytes(b"x" * 1000)
    with large.open("wb") as file:
        file.truncate(10**9)
    assert ReadingLimits.of([tmp_path / "nothing"]).processor_s == ReadingLimits.of([small]).processor_s == 60
    assert ReadingLimits.of([small, large]).processor_s >= 3000
    assert ReadingLimits.of([small]).memory_bytes <= 1_600_000_000
    assert ReadingLimits.of([tmp_path]).processor_s >= 3000
