"""Answers on their way, without a bus."""

import threading

import pytest
import zenoh

from touchline.bus.replies import Lane, Replies


def test_who_serves_does_not_wait_for_a_client_that_takes_nothing():
    replies, taken, sent = Replies(), threading.Event(), []

    def stuck() -> None:
        assert taken.wait(60.0)

    for number in range(5000):  # more than may wait
        replies.send(Lane.FIRST, stuck if number == 0 else lambda number=number: sent.append(number))
    taken.set()
    replies.close()
    assert sent[-1] == 4999
    assert len(sent) < 4999


def test_no_kind_of_answer_holds_up_another():
    replies, taken, sent = Replies(), threading.Event(), threading.Event()
    for lane in (Lane.FIRST, Lane.OTHER):
        replies.send(lane, lambda: taken.wait(60.0))
    replies.send(Lane.STOP, sent.set)
    assert sent.wait(60.0)
    taken.set()
    replies.close()


@pytest.mark.parametrize("error", [zenoh.ZError("gone"), ValueError("a defect")])
def test_what_goes_wrong_with_one_answer_costs_no_other(error):
    replies, sent = Replies(), threading.Event()

    def failing() -> None:
        raise error

    replies.send(Lane.FIRST, failing)
    replies.send(Lane.FIRST, sent.set)
    assert sent.wait(60.0)
    replies.close()
