"""Missing messages are counted though nothing comes after them."""

import time
from collections.abc import Callable
from pathlib import Path
from unittest.mock import MagicMock

import pytest

from tests.bridge.said import messages, record
from touchline.bus.counters import LARGEST_GAP, MOST_PUBLISHERS, SequenceGaps
from touchline.bus.last_sent import KEY, LastSent, as_text, sent_by
from touchline.jobs.recording.recording_end import lacking
from touchline.recordings.reader import read_summary
from touchline.schemas.messages import DiagnosticArray, DiagnosticStatus, KeyValue, RecordStopResponse
from touchline.services.bridge import recording_service
from touchline.services.bridge.recording_service import BridgeService
from touchline.services.bridge.standstill_detector import STANDSTILL_S, StandstillDetector

A, B = b"a" * 16, b"b" * 16


def test_a_publishers_word_tells_what_is_missing_at_the_end_and_only_once() -> None:
    gaps = SequenceGaps()
    assert [gaps.missed(A, number) for number in (5, 6, 9)] == [0, 0, 2]
    assert gaps.take_report(A, 9) == 0
    assert gaps.take_report(A, 12) == 3
    assert gaps.take_report(A, 12) == 0
    assert gaps.missed(A, 13) == 0
    assert gaps.missed(A, 15) == 1
    assert gaps.take_report(A, 15) == 0


def test_what_comes_by_two_ways_counts_once() -> None:
    gaps = SequenceGaps()
    gaps.missed(A, 5)
    gaps.missed(A, 8)
    gaps.begin_again()
    assert [gaps.missed(A, number) for number in (6, 7, 8, 9, 11)] == [-1, -1, -1, 0, 1]
    assert [gaps.missed(B, number) for number in (4, 5)] == [0, 0]


def test_counting_begins_with_the_first_word_of_who_was_not_heard() -> None:
    gaps = SequenceGaps()
    assert gaps.take_report(A, 7) == 0
    assert gaps.take_report(A, 9) == 2
    assert gaps.missed(A, 12) == 2
    assert gaps.take_report(B, 0) == 0
    assert gaps.missed(B, 3) == 2


def test_a_late_joiners_copy_of_the_last_message_is_taken_after_the_word_of_it() -> None:
    gaps = SequenceGaps()
    assert gaps.take_report(A, 7) == 0
    assert gaps.missed(A, 7) == 0
    assert gaps.missed(A, 8) == 0


def test_a_word_that_cannot_be_true_counts_nothing() -> None:
    gaps = SequenceGaps()
    gaps.missed(A, 5)
    assert gaps.take_report(A, 5 + LARGEST_GAP + 1) == 0
    assert gaps.take_report(A, 3) == 0


def test_who_has_told_is_not_forgotten_for_strangers() -> None:
    gaps = SequenceGaps()
    gaps.missed(A, 5)
    gaps.take_report(A, 5)
    for stranger in range(2 * MOST_PUBLISHERS):
        gaps.missed(b"%16d" % stranger, 1)
    assert len(gaps) == MOST_PUBLISHERS
    assert gaps.take_report(A, 8) == 3


def test_what_was_sent_is_told_in_the_diagnostics() -> None:
    sent = [LastSent("clock", A, 0), LastSent("imu/data_raw", B, 12345)]
    value = KeyValue(key=KEY, value=f"{as_text(sent)} clock:xyz:1 clock:{A.hex()}:-1 {A.hex()}")
    told = DiagnosticArray(
        status=(DiagnosticStatus(name="telemetry", values=(value,)), DiagnosticStatus(name="other", values=(value,)))
    )
    assert sent_by("telemetry", told) == sent
    assert sent_by("nobody", told) == []


def test_a_recording_has_in_it_what_is_missing_at_its_end(tmp_path: Path) -> None:
    recorder = record(tmp_path / "a.mcap", messages(100))
    recorder.lose("imu/data_raw", 17, "tt2")
    recorder.lose("clock", 2, "tt2")
    report = recorder.finish()
    held = read_summary(report.path).metadata
    assert (report.lost, report.problem) == (19, "")
    assert held["touchline_lost"] == {"total": "19", "/tt2/imu/data_raw": "17", "/tt2/clock": "2"}
    at = f"{recorder.now_ns('tt2') / 1e9:.3f}"
    assert held["touchline_lost_1"] == {"from_s": at, "to_s": at, "/tt2/imu/data_raw": "17", "/tt2/clock": "2"}


def test_a_recording_of_whose_end_nobody_knows_says_so(tmp_path: Path) -> None:
    report = record(tmp_path / "a.mcap", messages(10)).finish(unasked=["telemetry of tt2"])
    assert report.problem == "its end may be missing: telemetry of tt2 could not be asked what was sent last"
    summary = read_summary(report.path)
    assert summary.complete and summary.metadata["touchline_unasked"] == {"publishers": "telemetry of tt2"}


def test_only_a_long_turn_is_a_standstill() -> None:
    steadiness = StandstillDetector()
    for now_s in (1000.0, 1000.3, 1000.3 + 0.9 * STANDSTILL_S):
        steadiness.turn(now_s)
        assert not steadiness.lost
    steadiness.meet(lambda: frozenset("before"))
    steadiness.turn(1009.0)
    assert steadiness.lost
    steadiness.meet(lambda: frozenset("after"))
    assert steadiness.peers == frozenset("before")  # who has gone meanwhile can be told
    assert steadiness.recovered() == pytest.approx(1009.0 - 1000.3 - 0.9 * STANDSTILL_S)
    assert not steadiness.lost
    steadiness.meet(lambda: frozenset("after"))
    assert steadiness.peers == frozenset("after")


@pytest.mark.parametrize(
    ("report", "says"),
    [
        (RecordStopResponse(success=True, path="/x/a.mcap", messages=9), ""),
        (RecordStopResponse(success=True, path="/x/a.mcap", lost=1234), "it lacks 1,234 messages"),
        (RecordStopResponse(success=True, path="/x/a.part2.mcap"), "a.part2.mcap has what came after"),
        (RecordStopResponse(success=False, message="disk full"), "disk full"),
        (None, "has not answered"),
    ],
)
def test_a_report_says_why_a_recording_is_not_whole(report: RecordStopResponse | None, says: str) -> None:
    problem = lacking(report, Path("a.mcap"))
    assert says in problem and bool(problem) == bool(says)


def test_a_bridge_that_is_to_end_does_not_wait_for_a_router_that_is_gone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recording_service, "_HANDSHAKE_TIMEOUT_S", 0.1)
    until_s = time.monotonic() + 60.0

    def rejoin(stop: Callable[[], object]) -> None:
        while not stop():
            assert time.monotonic() < until_s
        raise KeyboardInterrupt

    bus = MagicMock(rejoin=rejoin)
    BridgeService([bus], MagicMock(), stop=lambda: True)._rejoin()
