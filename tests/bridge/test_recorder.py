"""A recording holds the messages as they were sent, and others can read it, whatever happens meanwhile."""

import os
import resource
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability, QosHistory, QosReliability

from tests.bridge.said import messages, record, sent, stamp
from touchline.recordings.channels import is_drawn
from touchline.recordings.reader import RecordingReader, read_summary
from touchline.recordings.recorder import Existing, Recorder, is_stamped
from touchline.recordings.recording_file import RecordingError
from touchline.schemas import topics
from touchline.schemas.cdr import encode, full_definition, type_hash
from touchline.schemas.messages import Clock, Header, Imu, NavSatFix, String

ROOT = Path(__file__).resolve().parents[2]


def test_round_trip(recording: Path) -> None:
    said = [(topic, encode(message)) for topic, message in messages(200)]
    reader = RecordingReader(recording)
    read = [(item.topic, item.payload) for item in reader.messages() if not is_drawn(item.topic, ("tt2",))]
    assert sorted(read) == sorted((f"/tt2/{topic.name}", payload) for topic, payload in said)
    assert [p for t, p in read if t == "/tt2/imu/data_raw"] == [p for t, p in said if t is topics.IMU]
    assert reader.summary.complete and reader.summary.problem == ""
    assert sent(reader.summary) == len(said)
    assert reader.summary.metadata["touchline_lost"] == {"total": "0"}


def test_a_reader_that_sorts_by_log_time_delivers_in_the_order_of_arrival(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.mcap")
    course = [
        ("clock", 0),
        ("imu/data_raw", 1),
        ("gnss/fix", -11),
        ("imu/data_raw", 2),
        ("clock", 10),
        ("gnss/fix", -1),
    ]
    course += [("imu/data_raw", 10**9), ("clock", 20)]  # a stranger's stamp moves nothing
    course += [("clock", -1000), ("imu/data_raw", -999), ("clock", -990)]  # a robot that was started again
    kinds = {"clock": None, "imu/data_raw": Imu, "gnss/fix": NavSatFix}
    for number, (name, tick) in enumerate(course):
        kind = kinds[name]
        at = stamp(2000 + tick)
        recorder.write(name, encode(Clock(clock=at) if kind is None else kind(header=Header(stamp=at))), number)
    path = recorder.finish().path
    with path.open("rb") as stream:
        found = [message for _, _, message in make_reader(stream).iter_messages(log_time_order=True)]
    assert [message.sequence for message in found] == list(range(len(course)))
    ticks = [message.log_time // 10**7 for message in found]
    assert ticks == [2000, 2001, 2001, 2002, 2010, 2010, 2010, 2020, 2020, 2021, 2030]
    assert [message.publish_time // 10**7 for message in found] == [2000 + tick for _, tick in course]


def test_a_message_without_a_stamp_takes_the_clock(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.mcap")
    recorder.write("template", encode(String(data="before the first clock")), 0)
    recorder.write("clock", encode(Clock(clock=stamp(500))), 0)
    recorder.write("imu/data_raw", encode(Imu(header=Header(stamp=stamp(450)))), 0)
    recorder.write("template", encode(String(data="after")), 1)
    recorder.finish()
    read = {(item.topic, item.sequence): item for item in RecordingReader(recorder.path).messages()}
    assert {item.log_time_ns for item in read.values()} == {5 * 10**9}
    assert {read["/tt2/template", number].publish_time_ns for number in (0, 1)} == {5 * 10**9}
    assert read["/tt2/imu/data_raw", 0].publish_time_ns == 4_500_000_000


def test_only_messages_that_begin_with_a_time_are_stamped() -> None:
    unstamped = {topic.name for topic in topics.RECORDED if not is_stamped(topic)}
    of_teams = {"fleet/setup", "fleet/queue", "algorithm/state", "algorithm/wish"}
    assert unstamped == {"plan", "template", "setup", "traversal/claimed", "traversal/initial_state"} | of_teams


def test_mcap_reader_finds_schemas_and_metadata(recording: Path) -> None:
    with recording.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        assert (reader.get_header().profile, reader.get_header().library) == (
            "ros2",
            f"touchline {version('touchline')}",
        )
        held = reader.get_summary()
        assert held is not None and held.statistics is not None
        channels = {channel.topic: channel for channel in held.channels.values()}
        assert set(channels) == {f"/tt2/{topic.name}" for topic in (*topics.RECORDED, *topics.VIEWING)}
        for topic in (*topics.RECORDED, *topics.VIEWING):
            channel = channels[f"/tt2/{topic.name}"]
            schema = held.schemas[channel.schema_id]
            assert (schema.name, schema.encoding) == (topic.type.ros_type, "ros2msg")
            assert schema.data.decode() == full_definition(topic.type)
            assert channel.message_encoding == "cdr"
            assert channel.metadata["topic_type_hash"] == type_hash(topic.type)
        assert {index.compression for index in held.chunk_indexes} == {"zstd"}
        assert all(index.message_index_offsets for index in held.chunk_indexes)
        assert sum(1 for _ in reader.iter_messages()) == held.statistics.message_count


def test_rosbags_reads_it_as_a_ros2_bag(recording: Path) -> None:
    """With the schemas of the file alone: rosbags is not given our message definitions."""
    with AnyReader([recording]) as reader:
        offered = {connection.topic: connection.ext.offered_qos_profiles[0] for connection in reader.connections}
        rates = [
            reader.deserialize(payload, connection.msgtype).angular_velocity.z
            for connection, _, payload in reader.messages()
            if connection.topic == "/tt2/imu/data_raw"
        ]
        marks = [
            reader.deserialize(payload, connection.msgtype)
            for connection, _, payload in reader.messages()
            if connection.topic == "/tt2/truth/paint"
        ]
    assert rates == [0.5 * tick for tick in range(200)]
    assert marks[3].segment_id == "a" and marks[3].x_m.tolist() == [0.0, 30.0]
    assert offered["/tt2/truth/paint"].reliability == QosReliability.RELIABLE
    assert offered["/tt2/truth/paint"].history == QosHistory.KEEP_ALL
    assert offered["/tt2/traversal/status"].durability == QosDurability.TRANSIENT_LOCAL


def test_the_same_run_gives_the_same_file(tmp_path: Path) -> None:
    first, second = (record(tmp_path / f"{name}.mcap", messages(300)).finish().path for name in "ab")
    assert first.read_bytes() == second.read_bytes()


def test_what_is_missing_is_told_with_its_place(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.mcap")
    for tick, missed in ((0, 0), (10, 0), (50, 39), (51, 0), (60, 8), (300, 0), (400, 2)):
        recorder.write("imu/data_raw", encode(Imu(header=Header(stamp=stamp(tick)))), tick, missed)
        if tick == 51:
            recorder.write("clock", encode(Clock(clock=stamp(50))), 6, 3)
    assert (recorder.lost, recorder.gaps) == (52, 2)
    report = recorder.finish({("tt2", "clock"): 2, ("tt2", "template"): 1})
    assert (report.messages, report.lost, report.rejected) == (8, 52, 3)
    metadata = read_summary(report.path).metadata
    assert metadata["touchline_lost"] == {"total": "52", "/tt2/clock": "3", "/tt2/imu/data_raw": "49"}
    assert metadata["touchline_lost_1"] == {
        "from_s": "0.100",
        "to_s": "0.600",
        "/tt2/imu/data_raw": "47",
        "/tt2/clock": "3",
    }
    assert metadata["touchline_lost_2"] == {"from_s": "3.000", "to_s": "4.000", "/tt2/imu/data_raw": "2"}
    assert metadata["touchline_rejected"] == {"total": "3", "/tt2/clock": "2", "/tt2/template": "1"}
    assert recorder.finish() is report


def test_an_empty_recording_is_whole(tmp_path: Path) -> None:
    report = Recorder(tmp_path / "empty.mcap").finish()
    held = read_summary(report.path)
    assert (report.messages, held.messages, held.complete) == (0, 0, True)
    assert len(held.topics) == len(topics.RECORDED) + len(topics.VIEWING)


def test_an_older_recording_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    ticks = (10, 20, 30)
    for count in ticks:
        record(path, messages(count)).finish()
    names = ("a.1.mcap", "a.2.mcap", "a.mcap")
    read = [list(RecordingReader(tmp_path / name).messages({"/tt2/imu/data_raw"})) for name in names]
    assert tuple(map(len, read)) == ticks
    with pytest.raises(RecordingError, match="is there already"):
        Recorder(path, existing=Existing.REFUSE)
    Recorder(path, existing=Existing.REPLACE).finish()
    assert read_summary(path).messages == 0
    assert len(list(tmp_path.iterdir())) == 3


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("a.bag", "ends in .mcap"),
        ("missing/a.mcap", "folder does not exist"),
        ("folder.mcap", "is no recording"),
        ("x" * 300 + ".mcap", "name too long"),
        ("a\0.mcap", "null byte"),
    ],
)
def test_a_path_that_cannot_be_recorded_to_is_refused(tmp_path: Path, name: str, reason: str) -> None:
    (tmp_path / "folder.mcap").mkdir()
    with pytest.raises(RecordingError, match=f"(?i){reason}"):
        Recorder(tmp_path / name)


@pytest.mark.parametrize("existing", Existing)
def test_what_is_no_recording_is_neither_moved_nor_replaced(tmp_path: Path, existing: Existing) -> None:
    path = tmp_path / "a.mcap"
    path.write_text("a letter")
    with pytest.raises(RecordingError, match="is there already"):
        Recorder(path, existing=existing)
    assert [(found.name, found.read_text()) for found in tmp_path.iterdir()] == [("a.mcap", "a letter")]


@pytest.mark.skipif(os.getuid() == 0, reason="root may write anywhere")
def test_a_folder_that_may_only_be_read_is_told(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(RecordingError, match="Permission denied"):
        Recorder(tmp_path / "a.mcap")


KILLED = """
import os, signal, sys
from pathlib import Path
from tests.bridge.said import messages, record
recorder = record(Path(sys.argv[1]), messages(2050))
recorder.flush()
record_more = record(Path(sys.argv[1] + ".other.mcap"), messages(2050))
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_after_kill_9_what_was_recorded_can_be_read(tmp_path: Path) -> None:
    path = tmp_path / "killed.mcap"
    done = subprocess.run([sys.executable, "-c", KILLED, str(path)], cwd=ROOT, timeout=300, check=False)
    assert done.returncode == -signal.SIGKILL
    said = sum(1 for _ in messages(2050))
    flushed, unflushed = read_summary(path), read_summary(Path(f"{path}.other.mcap"))
    assert sent(flushed) == said
    assert not flushed.complete
    # Without a flush at most the last chunk is missing.
    assert said - 400 < sent(unflushed) < said
    assert unflushed.topics["/tt2/imu/data_raw"].ros_type == "sensor_msgs/msg/Imu"


def test_a_file_cut_anywhere_gives_what_came_before(recording: Path) -> None:
    whole = [item.payload for item in RecordingReader(recording).messages()]
    data = recording.read_bytes()
    for cut in range(20, len(data), len(data) // 40):
        recording.write_bytes(data[:cut])
        reader = RecordingReader(recording)
        read = [item.payload for item in reader.messages()]
        assert read == whole[: len(read)]
        assert not reader.summary.complete or len(read) == len(whole)
        assert reader.summary.problem


@contextmanager
def full_disk(at_bytes: int) -> Iterator[None]:
    """A file size limit, which fails the same write that a full disk does."""
    usual = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (at_bytes, usual[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, usual)


@pytest.mark.parametrize("limit", [100, 5_000, 30_000, 30_001])
def test_a_full_disk_is_told_and_leaves_a_whole_file(tmp_path: Path, limit: int) -> None:
    path, refusals = tmp_path / "full.mcap", []
    with full_disk(limit):
        recorder = Recorder(path)
        for number, (topic, message) in enumerate(messages(4000)):
            try:
                recorder.write(topic.name, encode(message), number)
            except RecordingError as error:
                refusals.append(str(error))
                if len(refusals) == 3:
                    break
        report = recorder.finish()
    assert len(refusals) == 3 and all("cannot write" in refusal for refusal in refusals)
    assert "the recording ends before it" in report.problem
    held = read_summary(path)
    assert (sent(held), held.size_bytes, held.problem) == (report.messages, report.bytes, "")
    assert report.messages > 0 or limit < 30_000
    said = [encode(message) for topic, message in messages(4000) if topic is topics.IMU]
    kept = [item.payload for item in RecordingReader(path).messages({"/tt2/imu/data_raw"})]
    assert kept == said[: len(kept)]


def test_a_disk_that_is_full_from_the_start_leaves_no_file(tmp_path: Path) -> None:
    path = tmp_path / "full.mcap"
    with full_disk(10), pytest.raises(RecordingError, match="cannot write"):
        Recorder(path)
    assert not path.exists()
