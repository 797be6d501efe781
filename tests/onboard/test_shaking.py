"""An accelerometer that shakes is believed less; one jolt is none."""

from collections.abc import Iterable

import numpy as np
import pytest

from touchline.onboard.estimation.aiding.imu_aiding import add_shaking_noise
from touchline.onboard.filter_model import SPEED, STATES, TickInputs

TICK_S = 0.01


def _doubt(samples_mps2: Iterable[float]) -> float:
    """The variance (m²/s²) that these samples, 100 a second, add to the speed in all; a tick has the mean of two."""
    covariance, before = np.zeros((STATES, STATES)), TickInputs(accel_mps2=0.0)
    last = 0.0
    for sample in samples_mps2:
        now = TickInputs()
        now.accel_mps2, last = 0.5 * (last + sample), sample
        add_shaking_noise(covariance, before.array[0], now.array[0])
        before = now
    return float(covariance[SPEED, SPEED])


def test_shaking_adds_what_such_noise_adds_to_the_integrated_speed() -> None:
    sigma_mps2 = 0.6
    samples = np.random.default_rng(1).normal(0.0, sigma_mps2, 20_000)
    assert _doubt(samples) == pytest.approx(len(samples) * (sigma_mps2 * TICK_S) ** 2, rel=0.06)


@pytest.mark.parametrize(
    "samples_mps2",
    [
        np.random.default_rng(1).normal(0.0, 0.1, 2_000),  # eight times the data sheet's
        [0.0] * 50 + [20.0] + [0.0] * 50,  # one jolt
        [0.0] * 50 + [-1.6] * 50 + [0.0] * 50,  # a hard stop
        [float("nan")] * 100,  # no samples at all
    ],
    ids=["data sheet", "jolt", "stop", "none"],
)
def test_nothing_less_is_shaking(samples_mps2: Iterable[float]) -> None:
    assert _doubt(samples_mps2) == 0.0


def test_a_pause_in_the_samples_is_no_step() -> None:
    shaking = np.random.default_rng(2).normal(0.0, 0.6, 100)
    with_a_pause = np.concatenate([shaking, np.full(50, np.nan), np.zeros(2)])
    assert 0.0 < _doubt(shaking) <= _doubt(with_a_pause) < np.inf
