"""The plan of a replay: everything, in order, at its time."""

from pathlib import Path

from tests.bridge.foreign import foreign
from tests.bridge.said import messages, stamp
from touchline.recordings.channels import namespace_at, topic_at
from touchline.recordings.reader import RecordingReader
from touchline.recordings.recorder import Recorder
from touchline.recordings.replay.replayer import Timeline, recorded_robots
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.messages import Clock, String
from touchline.schemas.topics import Topic


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
    assert namespace_at("/tt2/gnss/fix") == "tt2"
    assert namespace_at("/fleet/seven/supervisor/events") == "fleet/seven"
    assert namespace_at("/events") == namespace_at("/tt2/other") == ""


def clocks(recorder: Recorder, namespace: str, ticks: range) -> None:
    for tick in ticks:
        recorder.write("clock", encode(Clock(clock=stamp(tick))), tick, namespace=namespace)


def test_robots_that_drive_at_the_same_time_are_replayed_at_the_same_time(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.mcap", ("r1", "club/r2"))
    for second in range(20):
        for robot in ("r1", "club/r2"):
            clocks(recorder, robot, range(100 * second, 100 * (second + 1), 10))
    path = recorder.finish().path
    assert recorded_robots(path) == ("r1", "club/r2")
    cues = list(Timeline(path).cues())
    for robot in ("r1", "club/r2"):
        times = [cue.at_s for cue in cues if cue.namespace == robot]
        assert all(abs(at_s - number / 10) <= 1.0 for number, at_s in enumerate(times))
    assert [cue.at_s for cue in cues] == sorted(cue.at_s for cue in cues)
    assert cues[-1].at_s < 20.0


def test_a_robot_that_began_when_another_was_far_is_replayed_from_there(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.mcap", ("r1", "r2"))
    clocks(recorder, "r2", range(1))
    clocks(recorder, "r1", range(0, 6000, 10))
    clocks(recorder, "r2", range(10, 310, 10))
    clocks(recorder, "r1", range(6000, 6010, 10))  # it stood meanwhile
    cues = list(Timeline(recorder.finish().path).cues())
    begun, ended = cues[601].at_s, cues[-2].at_s
    assert begun == 59.9
    assert ended == 59.9 + 2.9
    assert cues[-1].at_s == ended


def test_log_times_of_a_robot_are_the_same_alone_and_beside_another(tmp_path: Path) -> None:
    alone, beside = Recorder(tmp_path / "a.mcap", ("r2",)), Recorder(tmp_path / "b.mcap", ("r1", "r2"))
    for recorder in (alone, beside):
        for round_ in range(5):
            if recorder is beside:
                clocks(recorder, "r1", range(10_000 + 50 * round_, 10_050 + 50 * round_))
            clocks(recorder, "r2", range(9 * round_, 9 * (round_ + 1)))
            recorder.write("template", encode(String(data="x")), round_, namespace="r2")

    def of_r2(recorder: Recorder) -> list[tuple[str, int, int, bytes]]:
        found = RecordingReader(recorder.finish().path).messages()
        return [(m.topic, m.log_time_ns, m.publish_time_ns, m.payload) for m in found if m.topic.startswith("/r2/")]

    assert len(of_r2(alone)) == 50
    assert of_r2(alone) == of_r2(beside)


def test_what_was_recorded_with_another_schema_is_not_sent_and_it_is_said_why(tmp_path: Path) -> None:
    said = [("/tt2/template", 5, encode(String(data="x")))]
    renamed = Timeline(foreign(tmp_path / "a.mcap", said, schema="string text"))
    assert list(renamed.cues()) == [] and renamed.skipped == 1
    assert renamed.reasons == ["/tt2/template: field text of the recording is called data in the topic table"]
    json = Timeline(foreign(tmp_path / "b.mcap", said, encoding="json"))
    assert list(json.cues()) == []
    assert json.reasons == ["/tt2/template: recorded as json in the recording, as cdr in the topic table"]
