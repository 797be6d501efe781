"""The time that a job waits for a robot that stands, by that robot's reports."""

import pytest

from touchline.jobs.single import stall_detector
from touchline.jobs.single.stall_detector import ENDS_BY_ITSELF_S, STALLED_S, StallDetector, waits_for_operator
from touchline.schemas.messages import PauseStatus, TraversalStatus

PAUSED = TraversalStatus(state=TraversalStatus.PAUSED, reason="paused by the operator", arc_length_m=3.0)
BY_ITSELF = PauseStatus(cause=PauseStatus.LOCALIZATION, ends_by_itself=True)


@pytest.fixture
def wall(monkeypatch):
    """A clock that the test sets."""
    now = [100.0]
    monkeypatch.setattr(stall_detector.time, "monotonic", lambda: now[0])
    return now


def stands_for(wall, status, pause):
    """Time for which it is waited for (s); at most an hour."""
    waited, began_s = StallDetector(), wall[0]
    while wall[0] < began_s + 3600.0:
        if waited.stalled(status, pause):
            return wall[0] - began_s
        wall[0] += 0.5
    return float("inf")


@pytest.mark.parametrize(
    ("pause", "longest_s"),
    [
        (PauseStatus(cause=PauseStatus.OPERATOR), float("inf")),
        (PauseStatus(cause=PauseStatus.WATCHDOG), STALLED_S),
        (PauseStatus(cause=PauseStatus.SHUT_DOWN), STALLED_S),
        (PauseStatus(cause=PauseStatus.LINK), STALLED_S),
        (PauseStatus(cause=PauseStatus.HAZARD), STALLED_S),
        (PauseStatus(), STALLED_S),
        (BY_ITSELF, ENDS_BY_ITSELF_S),
    ],
)
def test_a_pause_is_waited_for_by_its_cause_and_not_by_its_words(wall, pause, longest_s):
    assert stands_for(wall, PAUSED, pause) == pytest.approx(longest_s, abs=1.0)
    assert waits_for_operator(PAUSED, pause) == (pause.cause == PauseStatus.OPERATOR)


def test_what_has_moved_or_was_waited_for_has_its_time_anew(wall):
    waited, running = StallDetector(), PAUSED.model_copy(update={"state": TraversalStatus.RUNNING})
    assert not waited.stalled(PAUSED, BY_ITSELF)
    wall[0] += 100.0
    assert not waited.stalled(PAUSED, BY_ITSELF)
    assert not waited.stalled(running, PauseStatus())
    wall[0] += STALLED_S - 1.0
    assert not waited.stalled(running.model_copy(update={"arc_length_m": 3.1}), PauseStatus())
    wall[0] += STALLED_S + 1.0
    assert "has not moved for 20 s" in waited.stalled(running.model_copy(update={"arc_length_m": 3.1}), PauseStatus())


def test_an_estimate_that_moves_is_no_progress(wall):
    waited = StallDetector()
    for k in range(int(2.0 * ENDS_BY_ITSELF_S)):
        wall[0] += 1.0
        if waited.stalled(PAUSED.model_copy(update={"arc_length_m": 3.0 + 0.01 * (k % 3)}), BY_ITSELF):
            break
    assert k == pytest.approx(ENDS_BY_ITSELF_S, abs=2.0)
