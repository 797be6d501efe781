"""The monitor of the innovations of fixes, alone: when it says that a filter is inconsistent, and when no longer."""

import math

import numpy as np
import pytest

from touchline.onboard.estimation import consistency_monitor as monitor
from touchline.onboard.filter_model import FilterCounters


def note(counters, white, speed_mps=1.0, heading_rad=0.0):
    """Correlations after each of (n, 2) innovations."""
    found = []
    for counters.fix_white_0, counters.fix_white_1 in white.tolist():
        monitor.note_innovation(counters.array[0], heading_rad, speed_mps, True)
        found.append(counters.fix_cross / max(counters.fix_power, 1e-9))
    return np.array(found)


def noise(n, correlation=0.0, seed=1):
    drawn = np.random.default_rng(seed).standard_normal((n, 2))
    for i in range(1, n):
        drawn[i] = correlation * drawn[i - 1] + math.sqrt(1.0 - correlation**2) * drawn[i]
    return drawn


def test_white_innovations_are_consistent_for_an_hour():
    counters = FilterCounters()
    assert note(counters, noise(36_000))[monitor.REMEMBERED_FIXES :].max() < 0.8 * monitor.INCONSISTENT_FROM
    assert not counters.inconsistent


@pytest.mark.parametrize("correlation", [0.9, 0.97])
def test_correlated_ones_are_not_and_within_half_a_minute(correlation):
    counters = FilterCounters()
    found = note(counters, noise(300, correlation, seed=3))
    assert found.max() > monitor.INCONSISTENT_FROM
    assert counters.inconsistent


def test_it_is_consistent_again_once_they_are_white():
    counters = FilterCounters()
    note(counters, noise(1000, 0.95))
    assert counters.inconsistent
    note(counters, noise(300, seed=2))
    assert counters.inconsistent, "it does not flicker"
    note(counters, noise(700, seed=4))
    assert not counters.inconsistent


def test_wild_fixes_and_standing_receivers_say_nothing():
    counters = FilterCounters()
    white = noise(600)
    white[::50] = 1e3
    note(counters, white)
    assert not counters.inconsistent
    note(counters, noise(1000, 0.95), speed_mps=0.0)
    assert not counters.inconsistent


def test_a_burst_at_the_start_is_no_inconsistency():
    counters = FilterCounters()
    white = 0.5 * noise(200)
    white[:20] = 2.0 * noise(20, 0.9, seed=5)
    note(counters, white)
    assert not counters.inconsistent


def test_innovations_far_smaller_than_their_sigma_are_consistent():
    counters = FilterCounters()
    note(counters, 0.12 * noise(1000, 0.95))
    assert not counters.inconsistent


@pytest.mark.parametrize("heading_rad", [0.0, 1.0, math.pi])
def test_unrest_is_that_of_innovations_to_one_side_for_long(heading_rad):
    """Across the heading as of a robot that wanders; what has been is not forgotten."""
    aside = np.array([-math.sin(heading_rad), math.cos(heading_rad)])
    counters, still = FilterCounters(), 0.2 * noise(300)
    note(counters, still[:59], heading_rad=heading_rad)
    assert counters.fix_unrest == 0.0
    note(counters, still[59:], heading_rad=heading_rad)
    assert 0.0 < counters.fix_unrest < 0.5
    note(counters, still + noise(300, 0.9, seed=7)[:, :1] * aside, heading_rad=heading_rad)
    most = counters.fix_unrest
    assert 1.5 < most < 6.0
    note(counters, still, heading_rad=heading_rad)
    assert counters.fix_unrest >= most
