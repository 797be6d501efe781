"""Answers on their way, without a bus."""

import threading

import zenoh

from services.bus.replies import Replies


def test_who_serves_does_not_wait_for_a_client_that_takes_nothing():
    replies, taken, sent = Replies(), threading.Event(), []

    def stuck() -> None:
        assert taken.wait(60.0)

    for number in range(5000):  # more than may wait
        replies.send(stuck if number == 0 else lambda number=number: sent.append(number))
    taken.set()
    replies.close()
    assert sent[-1] == 4999
    assert len(sent) < 4999


def test_repeats_do_not_hold_up_first_answers():
    replies, taken, sent = Replies(), threading.Event(), threading.Event()
    replies.send(lambda: taken.wait(60.0), again=True)
    replies.send(sent.set)
    assert sent.wait(60.0)
    taken.set()
    replies.close()


def test_a_client_that_has_left_costs_nothing_but_its_own_answer():
    replies, sent = Replies(), threading.Event()

    def gone() -> None:
        raise zenoh.ZError("gone")

    replies.send(gone)
    replies.send(sent.set)
    assert sent.wait(60.0)
    replies.close()
