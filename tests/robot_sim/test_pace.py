"""Ticks against the wall clock."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from touchline.services.robot_sim.pace import LONGEST_SLICE_S, Pacer


def ticks(pacer, seconds, step_s=0.004, start_s=100.0):
    return sum(pacer.due(start_s + index * step_s) for index in range(1, round(seconds / step_s) + 1))


@pytest.mark.parametrize("factor", [0.1, 0.5, 1.0, 3.0, 20.0, 100.0])
def test_n_times_real_time(factor):
    assert ticks(Pacer(factor, 100.0), 8.0) == pytest.approx(800 * factor, abs=2)


def test_hold_and_as_fast_as_it_goes():
    assert ticks(Pacer(0.0, 100.0), 5.0) == 0
    assert Pacer(-1.0, 0.0).due(0.0) > 1_000_000
    assert Pacer(-1.0, 0.0).wait_s(5.0) == 0.0
    assert Pacer(0.0, 0.0).wait_s(5.0) == LONGEST_SLICE_S


def test_a_change_of_pace_counts_from_now():
    pacer = Pacer(0.0, 0.0)
    pacer.set_factor(1.0, 50.0)
    assert pacer.due(50.1) == 10


def test_ticks_given_back_come_again():
    pacer = Pacer(1.0, 0.0)
    assert pacer.due(0.2) == 20
    pacer.give_back(15)
    assert pacer.due(0.2) == 15


def test_a_long_lag_is_not_caught_up_with():
    pacer = Pacer(1.0, 0.0)
    assert pacer.due(10.0) == 1
    assert pacer.due(10.1) == 10


def test_it_wakes_for_the_next_tick():
    pacer = Pacer(2.0, 0.0)
    assert pacer.due(0.0) == 0
    assert pacer.wait_s(0.001) == pytest.approx(0.004)
    assert pacer.wait_s(0.1) == 0.0


@given(st.lists(st.floats(0.0001, 0.2), min_size=1, max_size=50), st.floats(0.1, 50))
def test_never_more_than_the_clock_allows(steps, factor):
    pacer, now, given_out = Pacer(factor, 0.0), 0.0, 0
    for step in steps:
        now += step
        due = pacer.due(now)
        assert due >= 0
        given_out += due
    assert given_out <= now * factor * 100 + 1 + 1e-6


def test_changing_the_pace_all_the_time_does_not_stop_it():
    pacer, now_s, given_out = Pacer(1.0, 0.0), 0.0, 0
    for change in range(1000):
        now_s += 0.001
        pacer.set_factor((1.0, 2.0)[change % 2], now_s)
        given_out += pacer.due(now_s)
    assert 100 <= given_out <= 200


@pytest.mark.parametrize("factor", [0.5, 1.0, 5.0])
def test_ticks_of_many_robots_come_several_at_once_and_no_fewer(factor):
    pacer = Pacer(factor, 100.0)
    pacer.stride = 7
    handed = [pacer.due(100.0 + 0.004 * index) for index in range(1, 2001)]
    assert {ticks for ticks in handed if ticks} <= set(range(7, 7 + 4 * max(round(factor), 1)))
    assert sum(handed) == pytest.approx(800 * factor, abs=8)
    assert Pacer(1.0, 0.0).wait_s(0.0) == LONGEST_SLICE_S
