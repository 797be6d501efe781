"""Waiting before something in the way: its end, and what follows."""

from typing import NamedTuple

from touchline.services.robot_sim.way_round.waiting import PATIENT, Waiting, WaitingOrder


class Report(NamedTuple):
    since_tick: int
    moving: bool


def first_tick(waiting: Waiting, moving_until: int = 0, *, attended: bool = False, most: int = 3000) -> int | None:
    """Tick at which it goes round what stands there from tick 100 on."""
    looks = (
        (k, waiting.look(k, Report(100, k < moving_until), pausing=True, attended=attended))
        for k in range(100, most, 10)
    )
    return next((tick for tick, answer in looks if answer is WaitingOrder.GO_ROUND), None)


def test_it_waits_for_the_stated_times() -> None:
    assert first_tick(Waiting(PATIENT)) == 300
    assert first_tick(Waiting(PATIENT), moving_until=405) == 900
    assert first_tick(Waiting(PATIENT), attended=True) == 1600


def test_an_answer_counts_at_once_and_until_the_way_is_free() -> None:
    waiting = Waiting(PATIENT)
    waiting.look(100, Report(100, moving=False), pausing=True, attended=True)
    waiting.answer = WaitingOrder.LEAVE_OUT
    assert waiting.look(110, Report(100, moving=False), pausing=True, attended=True) is WaitingOrder.LEAVE_OUT
    waiting.answer = WaitingOrder.WAIT
    assert first_tick(waiting, attended=True) is None
    assert waiting.look(3000, None, pausing=False, attended=True) is None
    assert waiting.look(3010, Report(3010, moving=False), pausing=True, attended=False) is None
    assert waiting.look(3210, Report(3010, moving=False), pausing=True, attended=False) is WaitingOrder.GO_ROUND


def test_a_wait_goes_on_while_the_way_is_clear_for_a_moment() -> None:
    waiting = Waiting(PATIENT)
    for tick in range(100, 290, 20):
        assert waiting.look(tick, Report(tick, moving=False), pausing=True, attended=False) is None
        assert waiting.look(tick + 10, None, pausing=True, attended=False) is None
    assert waiting.look(300, Report(300, moving=False), pausing=True, attended=False) is WaitingOrder.GO_ROUND
