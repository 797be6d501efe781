"""Outcomes of orders, without a screen or a bus."""

import pytest

from touchline.schemas.messages import TraversalStatus
from touchline.tui.event_log import ERROR, INFO
from touchline.tui.order_registry import Change, OrderLine, OrderRegistry, Phase, StopLatch

RUNNING, IDLE, ESTOPPED = TraversalStatus.RUNNING, TraversalStatus.IDLE, TraversalStatus.ESTOPPED


def sent(robot: str = "one") -> StopLatch:
    latch = StopLatch()
    assert latch.press("a", robot) == "a"
    return latch


def text(latch: StopLatch, now_s: float = 0.0, state: str = "RUNNING") -> str:
    line = latch.line(now_s, state)
    return line.text if line else ""


def test_a_stop_holds_once_the_robot_says_that_it_is_stopped() -> None:
    latch = sent()
    for tries in range(1, 7):
        latch.tried("a", tries)
        assert text(latch) == f"E-STOP SENT {tries}/6"
    latch.tried("a", 9)
    assert text(latch) == "E-STOP NOT ACKNOWLEDGED – repeating (9)"
    latch.status(RUNNING, "one")
    assert latch.phase is Phase.SENT
    latch.status(ESTOPPED, "one")
    assert (text(latch), latch.changes) == ("E-STOP ACCEPTED", [Change.ACKNOWLEDGED])


def test_an_answer_does_not_end_it() -> None:
    latch = sent()
    assert latch.answered("a", "done", 1.0)
    assert not latch.answered("a", "done", 1.5)
    assert text(latch, 1.2) == "E-STOP SENT 1/6"  # the status may be on its way
    assert text(latch, 3.0) == "E-STOP ANSWERED BUT RUNNING – repeating (0)"
    assert latch.phase is Phase.SENT


def test_it_keeps_its_request_id_until_it_is_answered_or_acknowledged() -> None:
    latch = sent()
    assert latch.press("b", "one") == "a"
    latch.answered("a", "done", 1.0)
    assert latch.press("b", "one") == "b", "the robot does nothing for an id that it has answered"
    assert not latch.answer
    assert latch.press("c", "one") == "b"
    latch.status(ESTOPPED, "one")
    assert latch.press("c", "one") == "c"


def test_a_robot_that_comes_back_running_is_stopped_again_before_and_after_it_was_acknowledged() -> None:
    for acknowledged in (False, True):
        latch = sent()
        if acknowledged:
            latch.status(ESTOPPED, "one")
        latch.changes.clear()
        latch.status(IDLE, "two")
        assert latch.changes == [Change.RESTARTED]
        assert latch.phase is Phase.SENT


def test_a_robot_that_comes_back_stopped_is_left_alone() -> None:
    latch = sent()
    latch.status(ESTOPPED, "one")
    latch.changes.clear()
    latch.status(ESTOPPED, "two")
    assert (latch.phase, latch.changes) == (Phase.HELD, [])


def test_a_reset_by_anybody_releases_what_was_acknowledged() -> None:
    latch = sent()
    latch.status(ESTOPPED, "one")
    latch.status(TraversalStatus.PAUSED, "one")
    assert latch.phase is Phase.OFF
    assert latch.changes == [Change.ACKNOWLEDGED, Change.RELEASED]
    latch.status(RUNNING, "one")
    assert latch.phase is Phase.OFF


@pytest.mark.parametrize("tries", [1, 2])
def test_an_order_is_sent_then_answered(tries: int) -> None:
    registry = OrderRegistry()
    registry.place("pause", "Pause", 3, now_s=0.0)
    registry.tried("pause", tries)
    assert registry.line(0.1, "RUNNING", running=True) is not None
    assert str(registry.line(0.1, "RUNNING", running=True)).count(f"Pause sent {tries}/3") == 1
    registry.done("pause", OrderLine(INFO, "Pause: done"), accepted=True, answered=True, now_s=0.2)
    assert "Pause: done" in str(registry.line(0.3, "PAUSED", running=False))
    assert "BUT THE ROBOT SAYS RUNNING" in str(registry.line(2.0, "RUNNING", running=True))
    assert registry.line(60.0, "PAUSED", running=False) is None


def test_a_pause_that_is_under_way_is_shown_before_anything_else_but_an_emergency_stop() -> None:
    registry = OrderRegistry()
    registry.place("pause", "Pause", 3, now_s=0.0)
    registry.say(ERROR, "something else", now_s=1.0)
    assert "Pause sent 1/3" in str(registry.line(1.0, "RUNNING", running=True))
    registry.stop.press("a", "one")
    assert "E-STOP SENT" in str(registry.line(1.0, "RUNNING", running=True))
