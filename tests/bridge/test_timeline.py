"""The plan of a replay: everything, in order, at its time."""

from pathlib import Path

from tests.bridge.foreign import foreign
from tests.bridge.said import messages, record, stamp
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.messages import Clock, Header, Imu, NavSatFix, String
from touchline.schemas.topics import Topic
from touchline.services.bridge.channels import topic_at
from touchline.services.bridge.recorder import Recorder
from touchline.services.bridge.replayer import Timeline


def test_everything_in_order_at_its_time(recording: Path) -> None:
    timeline = Timeline(recording)
    cues = list(timeline.cues())
    said = [(topic, encode(message)) for topic, message in messages(200)]
    # The text that came before the first clock is written behind it.
    assert [(cue.topic, cue.payload) for cue in cues if cue.topic is not topics.TEMPLATE] == said[1:]
    times = [cue.at_s for cue in cues]
    assert times == sorted(times)
    assert times[0] == 0.0 and times[-1] == 1.99
    assert timeline.reader.fraction == 1.0


def test_a_late_measurement_keeps_its_place(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.mcap")
    recorder.write("clock", encode(Clock(clock=stamp(100))), 0)
    recorder.write("gnss/fix", encode(NavSatFix(header=Header(stamp=stamp(89)))), 0)
    recorder.write("imu/data_raw", encode(Imu(header=Header(stamp=stamp(101)))), 0)
    cues = list(Timeline(recorder.finish().path).cues())
    assert [cue.topic.name for cue in cues] == ["clock", "gnss/fix", "imu/data_raw"]
    assert [cue.at_s for cue in cues] == [0.0, 0.0, 0.01]


def test_a_clock_that_begins_anew_goes_on_from_there(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.mcap")
    for sequence, tick in enumerate((9000, 9100, 0, 100)):
        recorder.write("clock", encode(Clock(clock=stamp(tick))), sequence)
    assert [cue.at_s for cue in Timeline(recorder.finish().path).cues()] == [0.0, 1.0, 1.0, 2.0]


def test_a_recording_broken_off_is_replayed_up_to_there(tmp_path: Path) -> None:
    path = record(tmp_path / "a.mcap", messages(2000)).finish().path
    whole = len(list(Timeline(path).cues()))
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    timeline = Timeline(path)
    assert 0 < len(list(timeline.cues())) < whole
    assert timeline.reader.summary.problem == "broken off, or still being written"


def test_topics_that_are_not_ours_are_counted(tmp_path: Path) -> None:
    foreign = Topic("camera/info", topics.EVENTS.type)
    recorder = Recorder(tmp_path / "a.mcap", topics=(foreign, topics.CLOCK))
    recorder.write("clock", encode(Clock()), 0)
    recorder.write("camera/info", encode(foreign.type()), 0)
    timeline = Timeline(recorder.finish().path)
    assert [cue.topic for cue in timeline.cues()] == [topics.CLOCK]
    assert timeline.skipped == 1


def test_topics_are_found_under_any_namespace() -> None:
    assert topic_at("/tt2/gnss/fix") is topics.GNSS_FIX
    assert topic_at("/fleet/seven/supervisor/events") is topics.SUPERVISOR_EVENTS
    assert topic_at("/events") is topics.EVENTS
    assert topic_at("/tt2/other") is None


def test_what_was_recorded_with_another_schema_is_not_sent_and_it_is_said_why(tmp_path: Path) -> None:
    said = [("/tt2/template", 5, encode(String(data="x")))]
    renamed = Timeline(foreign(tmp_path / "a.mcap", said, schema="string text"))
    assert list(renamed.cues()) == [] and renamed.skipped == 1
    assert renamed.reasons == ["/tt2/template: field text of the recording is called data in the topic table"]
    json = Timeline(foreign(tmp_path / "b.mcap", said, encoding="json"))
    assert list(json.cues()) == []
    assert json.reasons == ["/tt2/template: recorded as json in the recording, as cdr in the topic table"]
