"""Robots that are waited for no more in lockstep are named once each time, and every exchange without them counts."""

from types import SimpleNamespace

from touchline.coordination.late_robots import NOT_WAITED_FOR, WAITED_FOR_AGAIN, LateRobots
from touchline.schemas.messages import Event


def line(tick):
    return SimpleNamespace(has_reported=lambda asked: tick >= asked)


def test_who_is_silent_is_told_once_and_again_when_it_is_silent_once_more():
    told = []
    laggards = LateRobots(told.append, 1.0)
    for tick, behind in ((40, 40), (80, 40), (120, 40), (160, 160), (200, 160)):
        laggards.look(tick, {"tb1": line(tick), "tb2": line(behind)})
    assert [(event.code, event.severity) for event in told] == [
        (NOT_WAITED_FOR, Event.WARN),
        (WAITED_FOR_AGAIN, Event.INFO),
        (NOT_WAITED_FOR, Event.WARN),
    ]
    assert all("tb2" in event.text and "tb1" not in event.text for event in told)
    assert told[0].header.stamp.nanosec == 800_000_000 and "silent for 1 s (wall clock)" in told[0].text
    assert laggards.exchanges == {"tb2": 3}


def test_who_is_taken_out_while_silent_is_not_told_to_be_back():
    told = []
    laggards = LateRobots(told.append, 1.0)
    laggards.look(40, {"tb1": line(40), "tb2": line(0)})
    laggards.look(80, {"tb1": line(80)})
    assert [event.code for event in told] == [NOT_WAITED_FOR]
