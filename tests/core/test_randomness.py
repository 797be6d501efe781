"""Counter-based randomness: its distribution, and that every number stands alone."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import ndtr

from touchline.core.random import normal, uniform

KEYS = st.tuples(st.integers(0, 2**63 - 1), st.integers(0, 100), st.integers(-1, 2**40), st.integers(0, 100))
#: Exceeded by one in a hundred samples of that distribution.
LIKELY = 1.628


def draws(function, count, seed=1, stream=2, channel=0):
    return np.array([function(seed, stream, tick, channel) for tick in range(count)])


def kolmogorov_distance(shares):
    """Between the distribution of these and an even one from 0 to 1, times the root of their number."""
    count = len(shares)
    steps = np.arange(count + 1) / count
    return max(np.max(steps[1:] - np.sort(shares)), np.max(np.sort(shares) - steps[:-1])) * count**0.5


def test_uniforms_are_uniform():
    assert kolmogorov_distance(draws(uniform, 20_000)) < LIKELY


def test_normals_are_normal():
    values = draws(normal, 20_000)
    assert kolmogorov_distance(ndtr(values)) < LIKELY
    assert values.mean() == pytest.approx(0.0, abs=0.02)
    assert values.std() == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("changed", [{"seed": 2}, {"stream": 3}, {"channel": 1}])
def test_neighbouring_keys_are_independent(changed):
    base, other = draws(normal, 20_000), draws(normal, 20_000, **changed)
    assert abs(np.corrcoef(base, other)[0, 1]) < 0.025
    assert abs(np.corrcoef(base**2, other**2)[0, 1]) < 0.025


def test_successive_ticks_are_independent():
    values = draws(normal, 20_000)
    for lag in (1, 2, 10):
        assert abs(np.corrcoef(values[:-lag], values[lag:])[0, 1]) < 0.025


@given(KEYS)
def test_a_number_depends_on_its_key_alone(key):
    first = normal(*key)
    normal(1, 2, 3, 4)
    assert normal(*key) == first
    assert np.isfinite(first)
    assert 0.0 <= uniform(*key) < 1.0


@given(KEYS)
def test_every_word_of_the_key_counts(key):
    seed, stream, tick, channel = key
    value = uniform(*key)
    assert value != uniform(seed ^ 1, stream, tick, channel)
    assert value != uniform(seed, stream + 1, tick, channel)
    assert value != uniform(seed, stream, tick + 1, channel)
    assert value != uniform(seed, stream, tick, channel + 1)
