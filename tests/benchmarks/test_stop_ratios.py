"""Comparison of two systems whose emergency stops were given by turns."""

import numpy as np
import pytest

from benchmarks.stops import ratios


def test_the_interval_of_a_ratio_holds_what_is_so_and_not_what_is_not():
    chance = np.random.default_rng(1)
    machine_s, one_s, other_s = chance.lognormal(-4.0, 0.5, (3, 400))
    before, alike, slower = machine_s + one_s, machine_s + other_s, 2.0 * (machine_s + other_s)
    for quantile in (0.5, 0.9):
        ((_, first, last),) = ratios(before, alike, [quantile])
        assert first < 1.0 < last
        ((ratio, first, last),) = ratios(before, slower, [quantile])
        assert 1.0 < first < 2.0 < last
        assert ratio == pytest.approx(2.0, rel=0.2)
