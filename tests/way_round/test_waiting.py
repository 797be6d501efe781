"""Waiting before something in the way: its end, and what follows."""

from typing import NamedTuple

from touchline.services.robot_sim.way_round.waiting import PATIENT, Waiting, WaitingOrder


class Report(NamedTuple):
    since_tick: int
    moving: bool


def first_tick(waiting: Waiting, moving_until: int = 0, *, attended: bool = False, most: int = 3000) -> int | None:
    """Tick at which it goes round what stands there from tick 100 on."""
    looks = ((k, waiting.look(k, Report(100, k < moving_until), attended=attended)) for k in range(100, most, 10))
    return next((tick for tick, answer in looks if answer is WaitingOrder.GO_ROUND), None)


def test_it_waits_for_the_stated_times() -> None:
    assert first_tick(Waiting(PATIENT)) == 300
    assert first_tick(Waiting(PATIENT), moving_until=405) == 900
    assert first_tick(Waiting(PATIENT), attended=True) == 1600


def test_an_answer_counts_at_once_and_until_the_way_is_free() -> None:
    waiting = Waiting(PATIENT)
    waiting.look(100, Report(100, moving=False), attended=True)
    waiting.answer = WaitingOrder.LEAVE_OUT
    assert waiting.look(110, Report(100, moving=False), attended=True) is WaitingOrder.LEAVE_OUT
    waiting.answer = WaitingOrder.WAIT
    assert first_tick(waiting, attended=True) is None
    assert waiting.look(3300, None, attended=True) is None
    assert waiting.look(3310, Report(3310, moving=False), attended=False) is None
    assert waiting.look(3510, Report(3310, moving=False), attended=False) is WaitingOrder.GO_ROUND


def test_what_only_seems_to_go_is_waited_for_no_longer() -> None:
    """As at the limit of protection, where the noise of hits decides."""
    waiting = Waiting(PATIENT)
    seen = [Report(tick, moving=False) if tick % 200 < 150 else None for tick in range(0, 500, 10)]
    answers = [waiting.look(10 * k, each, attended=False) for k, each in enumerate(seen)]
    assert answers.index(WaitingOrder.GO_ROUND) == 20
