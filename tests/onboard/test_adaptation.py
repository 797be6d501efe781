"""Adaptation of the filter alone: when it begins, how far it goes, and that a right filter is left alone."""

import math

import numpy as np
import pytest

from tests.onboard.driven import drive, under_way
from touchline.onboard import filter_model as m
from touchline.onboard.estimation import adaptation
from touchline.onboard.estimation.consistency_monitor import note_innovation
from touchline.onboard.filter_model import BlindRun, FilterCounters
from touchline.onboard.interface import Command


def due_after(white):
    """Return True if a blind run was ever due in (n, 2) innovations of a moving robot."""
    counters, due = FilterCounters(), False
    for counters.fix_white_0, counters.fix_white_1 in white.tolist():
        note_innovation(counters.array[0], 0.0, 1.0, True)
        due = due or counters.inconsistent
    return due


def test_a_blind_run_is_never_due_for_white_innovations():
    assert not due_after(np.random.default_rng(1).standard_normal((36_000, 2)))


def test_it_is_due_within_ten_seconds_of_correlated_ones():
    noise = np.random.default_rng(2).standard_normal((100, 2))
    for i in range(1, 100):
        noise[i] = 0.96 * noise[i - 1] + 0.28 * noise[i]
    assert due_after(noise)


@pytest.mark.parametrize(("off_m", "wander"), [(0.05, 8.9), (0.6, 89.0), (5.0, 89.0)])
def test_wander_grows_with_the_error_and_within_bounds(off_m, wander):
    """By the error over its σ, at most threefold at a time; a small error takes a little away."""
    known = np.zeros((m.STATES, m.STATES))
    blind = BlindRun(wander=9.0, ticks=1000)
    blind.covariances[1] = 0.1**2 * np.eye(m.STATES)
    blind.states[1, m.EAST] = off_m
    adaptation.adapt_wander(blind.array[0], np.zeros(m.STATES), known)
    assert blind.wander == pytest.approx(wander, abs=0.15)
    for _ in range(5):
        adaptation.adapt_wander(blind.array[0], np.full(m.STATES, 10.0), known)
    assert blind.wander == adaptation.MOST_WANDER


@pytest.mark.parametrize("known", [0.0, 1.0], ids=["driving", "at rest"])
def test_wander_that_a_fault_has_taught_is_forgotten_within_minutes_of_driving(known):
    blind = BlindRun(wander=89.0, ticks=1600)
    blind.covariances[1] = np.eye(m.STATES)
    for _ in range(12):
        adaptation.adapt_wander(blind.array[0], np.zeros(m.STATES), known * np.eye(m.STATES))
    assert blind.wander == (89.0 if known else 0.0)


def test_wheels_that_speed_up_are_believed_and_those_that_jump_are_doubted():
    for mean_mps, share in ((0.08, 1.0), (2.0, 0.5)):
        P = 1e-4 * np.eye(m.STATES)
        r = adaptation.doubted_variance(P, (mean_mps, mean_mps), 1e-6)
        gain = P[m.SPEED, m.SPEED] / (P[m.SPEED, m.SPEED] + r)
        assert gain == pytest.approx(share, abs=0.02)
        assert math.sqrt(P[m.SPEED, m.SPEED]) >= mean_mps


@pytest.mark.parametrize("sway_m", [0.0, 0.08])
def test_a_right_filter_is_left_alone_and_a_wrong_one_claims_more_and_uses_its_fixes(sway_m):
    """The antenna sways sideways every 4 s, as on a robot that wanders more than its files say."""
    rig, estimator = under_way(4, 200)
    for tenths in range(400):
        rig.fix_offset_m = (0.0, sway_m * math.sin(math.tau * tenths / 40.0))
        drive(rig, estimator, 10, lambda _: Command((9.0, 9.0), False, False))
    rejected = estimator.counters.fixes_rejected
    if sway_m:
        assert estimator.ring.blind.wander > 1.0
        assert rejected < 40
    else:
        assert estimator.ring.blind.wander_most == 0.0
        assert rejected == 0
