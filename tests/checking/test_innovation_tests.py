"""Tests of innovations, on noise whose answers are known."""

import numpy as np
import pytest

from touchline.checking.estimating import innovation_tests as tests
from touchline.onboard.filter_model import FIX_LAG


def noise(n, axes, seed=1, correlation=0.0):
    drawn = np.random.default_rng(seed).standard_normal((n, axes))
    for i in range(1, n):
        drawn[i] = correlation * drawn[i - 1] + np.sqrt(1.0 - correlation**2) * drawn[i]
    return drawn


def test_white_innovations_pass_and_one_in_a_thousand_may_not():
    found = [tests.whiteness(noise(300, 2, seed), FIX_LAG) for seed in range(200)]
    assert sum(abs(each.correlation) > each.by_chance for each in found) <= 2


@pytest.mark.parametrize("correlation", [0.3, 0.6])
def test_correlated_ones_are_found_with_their_correlation(correlation):
    found = tests.whiteness(noise(2000, 2, correlation=correlation ** (1 / FIX_LAG)), FIX_LAG)
    assert found.correlation == pytest.approx(correlation, abs=0.1)
    assert found.found


def test_a_few_wild_ones_decide_nothing():
    white = noise(400, 2)
    white[100:103] = 1e6
    assert not tests.whiteness(white, FIX_LAG).found


def test_a_small_correlation_that_chance_does_not_explain_is_no_finding():
    found = tests.whiteness(noise(50_000, 2, correlation=0.05 ** (1 / FIX_LAG)), FIX_LAG)
    assert found.correlation > found.by_chance
    assert not found.found


def test_too_few_fixes_are_not_tested():
    assert tests.fixes_whiteness(np.zeros((50, 3)), 1) is None
