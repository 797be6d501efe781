"""A recording while it goes on: how much of it a kill can cost."""

import random
from collections.abc import Mapping
from pathlib import Path

import pytest

from tests.bridge.test_sequencer import Sent
from touchline.bus.last_sent import LastSent
from touchline.recordings.compare import compare
from touchline.recordings.part_limits import PartLimits
from touchline.recordings.reader import read_summary
from touchline.recordings.recorder import Recorder
from touchline.recordings.recording_file import RecordingError
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.messages import Clock, Event, Imu, Time
from touchline.services.bridge.recording_session import FLUSH_PERIOD_S, RecordingSession


class Waiting:
    """One message more each time that it is asked."""

    def __init__(self) -> None:
        self.said = 0
        self.namespace = "tt2"
        self.rejected: dict[str, int] = {}
        self.cut: set[str] = set()

    def drain(self, most: Mapping[str, int]) -> list[Sent]:
        self.said += 1
        return [Sent(topics.IMU, self.said, self.said, encode(Imu()))]

    def take_report(self, sent: LastSent) -> int:
        return 0


def test_what_was_heard_a_quarter_of_a_second_ago_is_on_the_disk(tmp_path: Path) -> None:
    path, inbox = tmp_path / "session.mcap", Waiting()
    session = RecordingSession(Recorder(path), [inbox])
    kept = []
    for tenth in range(13):
        session.pump(tenth / 10)
        kept.append(read_summary(path).messages)
    # The youngest message is held for a round: others may turn out to be older.
    assert FLUSH_PERIOD_S == 0.25
    assert kept == [0] * 3 + [3] * 3 + [6] * 3 + [9] * 3 + [12]


class Said(Waiting):
    """Of each tick of 0.1 s: its number, in a text that does not compress, behind the clock."""

    def drain(self, most: Mapping[str, int]) -> list[Sent]:
        self.said += 1
        clock = Clock(clock=Time(sec=self.said // 10, nanosec=self.said % 10 * 100_000_000))
        text = random.Random(self.said).randbytes(20_000).hex()
        status = Event(text=f"{self.said} {text}")
        return [
            Sent(topics.CLOCK, self.said, 2 * self.said, encode(clock)),
            Sent(topics.EVENTS, self.said, 2 * self.said + 1, encode(status)),
        ]


@pytest.mark.parametrize("limits", [PartLimits(max_bytes=1_000_000), PartLimits(max_s=2.0)], ids=["size", "time"])
def test_a_recording_with_limits_is_the_same_session_in_parts(tmp_path: Path, limits: PartLimits) -> None:
    sessions = []
    for name, given in (("parts", limits), ("whole", PartLimits())):
        session = RecordingSession(Recorder(tmp_path / f"{name}.mcap"), [Said()], given)
        for tenth in range(150):
            session.pump(tenth / 10)
        sessions.append(session)
        report = session.finish()
        assert report.path == tmp_path / f"{name}.mcap" and report.problem == ""
        assert report.messages == sum(report.per_topic.values()) == 302  # one round more at the end
        assert report.bytes == sum(part.stat().st_size for part in session.parts)
    parts = sessions[0].parts
    assert len(parts) > 2 and len(sessions[1].parts) == 1
    assert [part.name for part in parts[:3]] == ["parts.mcap", "parts.part2.mcap", "parts.part3.mcap"]
    result = compare(tmp_path / "parts.mcap", tmp_path / "whole.mcap")
    assert result.identical, list(result.lines())
    for number, part in enumerate(parts[1:], 2):
        held = next(file for file in read_summary(parts[0]).files if file.path == part)
        assert held.complete and held.messages
        assert read_summary(part).metadata["touchline_part"]["part"] == str(number)
    for part in parts[:-1]:
        if limits.max_s:
            assert 2.0 <= read_summary(part).files[0].messages / 20 <= 2.2 or part == parts[0]
        else:
            assert 1_000_000 <= part.stat().st_size < 1_500_000


@pytest.mark.parametrize(("size", "time_s"), [(1, 0.0), (999_999, 0.0), (0, 0.5), (0, -1.0), (0, float("nan"))])
def test_limits_that_leave_no_room_are_refused(size: int, time_s: float) -> None:
    with pytest.raises(RecordingError, match="give at least"):
        PartLimits(size, time_s)


def test_a_next_part_that_cannot_be_made_ends_the_recording_as_it_is(tmp_path: Path) -> None:
    session = RecordingSession(Recorder(tmp_path / "a.mcap"), [Said()], PartLimits(max_s=1.0))
    (tmp_path / "a.part2.mcap").write_text("no recording")
    with pytest.raises(RecordingError, match="is no recording"):
        for tenth in range(100):
            session.pump(tenth / 10)
    report = session.finish()
    assert "is no recording" in report.problem and report.messages > 0
    (tmp_path / "a.part2.mcap").unlink()
    held = read_summary(tmp_path / "a.mcap")
    assert held.complete and held.problem == "" and held.messages == report.messages
