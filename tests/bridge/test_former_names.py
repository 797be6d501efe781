"""Recordings made when a topic had another name are read as before."""

from pathlib import Path

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from tests.bridge.foreign import foreign
from tests.painted import read_painted
from touchline.recordings.channels import present_path, recorded_paths, topic_at
from touchline.recordings.compare import compare
from touchline.recordings.decoding import as_message
from touchline.recordings.reader import RecordingReader
from touchline.recordings.recorded import Recorded, RecordingKind
from touchline.recordings.recorder import Recorder
from touchline.recordings.recording_file import RecordingError
from touchline.recordings.replay.replayer import Timeline
from touchline.schemas import topics
from touchline.schemas.cdr import encode, full_definition
from touchline.schemas.messages import PaintMarks, String, TraversalStatus

TEMPLATE = '{"name": "one", "segments": [{"id": "a", "line": {"start": [0, 0], "end": [1, 0]}, "actuation": "SPRAY"}]}'
MARKS = PaintMarks(segment_id="a", width_m=0.12, x_m=[0.0, 1.0], y_m=[0.0, 0.0])


def named(path: Path, name: str, marks: PaintMarks = MARKS) -> Path:
    """A recording whose paint has that name."""
    said = [(name, 5, encode(marks))]
    return foreign(path, said, type_=PaintMarks.ros_type, schema=full_definition(PaintMarks))


def test_every_former_name_is_of_a_topic_and_of_no_other() -> None:
    assert not topics.FORMER_NAMES.keys() & topics.TOPIC_BY_NAME.keys()
    assert all(topics.TOPIC_BY_NAME[topic.name] is topic for topic in topics.FORMER_NAMES.values())


@pytest.mark.parametrize("namespace", ["", "/tt2", "/club/tt2"])
def test_a_former_name_leads_to_the_topic_under_any_namespace(namespace: str) -> None:
    former, present = f"{namespace}/paint/marks", f"{namespace}/truth/paint"
    assert topic_at(former) is topic_at(present) is topics.PAINT
    assert present_path(former) == present_path(present) == present
    assert recorded_paths(former) == recorded_paths(present) == (present, former)
    assert present_path("/elsewhere/marks") == "/elsewhere/marks"
    assert recorded_paths("/elsewhere/marks") == ("/elsewhere/marks",)


def test_paint_of_an_older_recording_is_drawn(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "new.mcap")
    recorder.write("template", encode(String(data=TEMPLATE)), 1)
    recorder.write("truth/paint", encode(MARKS), 1)
    now = read_painted(recorder.finish().path)
    data = [("/tt2/template", 1, encode(String(data=TEMPLATE))), ("/tt2/paint/marks", 5, encode(MARKS))]
    assert now.strokes == read_painted(foreign(tmp_path / "older.mcap", data)).strokes == [MARKS]


def test_an_older_recording_is_replayed_under_the_present_name(tmp_path: Path) -> None:
    (cue,) = Timeline(named(tmp_path / "old.mcap", "/tt2/paint/marks")).cues()
    assert (cue.topic, cue.payload) == (topics.PAINT, encode(MARKS))


@pytest.mark.parametrize("asked", [None, {"/tt2/paint/marks"}, {"/tt2/truth/paint"}])
def test_an_older_recording_is_compared_with_a_new_one(tmp_path: Path, asked: set[str] | None) -> None:
    old = named(tmp_path / "old.mcap", "/tt2/paint/marks")
    new = named(tmp_path / "new.mcap", "/tt2/truth/paint")
    result = compare(old, new, asked)
    assert result.identical and list(result.topics) == ["/tt2/truth/paint"]
    moved = MARKS.model_copy(update={"x_m": MARKS.x_m + 0.5})
    assert not compare(old, named(tmp_path / "moved.mcap", "/tt2/truth/paint", moved), asked).same
    with pytest.raises(RecordingError, match="neither recording has a message"):
        compare(old, new, {"/tt2/truth/odometry"})


def test_a_status_of_an_older_schema_is_read() -> None:
    older = "uint8 state\nstring segment_id\nfloat64 coverage_pct\nstring[] painted_ids\nfloat64[] painted_fraction\n"
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(older, TraversalStatus.ros_type))
    kind = store.types[TraversalStatus.ros_type]
    said = kind(state=2, segment_id="a", coverage_pct=40.0, painted_ids=["a"], painted_fraction=MARKS.x_m[1:] * 0.4)
    payload = bytes(store.serialize_cdr(said, TraversalStatus.ros_type))
    how = RecordingKind("cdr", TraversalStatus.ros_type, "ros2msg", older)
    read = as_message(TraversalStatus, Recorded("/tt2/traversal/status", 0, 0, 0, payload, how))
    assert (read.state, read.segment_id, read.coverage_pct) == (2, "a", 40.0)
    assert (read.painted_ids, read.painted_fraction.tolist(), read.spraying) == (("a",), [0.4], False)


def test_what_a_reader_gives_keeps_the_name_it_was_recorded_under(tmp_path: Path) -> None:
    reader = RecordingReader(named(tmp_path / "old.mcap", "/tt2/paint/marks"))
    assert [message.topic for message in reader.messages()] == ["/tt2/paint/marks"]
