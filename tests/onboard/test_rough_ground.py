"""Rough ground is felt: what it does to the accelerometer is explained neither by slips nor by slopes."""

import math

import numpy as np
import pytest

from touchline.onboard.estimation.aiding.imu_aiding import add_pitching_noise
from touchline.onboard.estimation.calibration import _learn_slope, start_learning, store_learned
from touchline.onboard.filter_model import ACCEL_BIAS, HEADING, SPEED, STATES, FilterFigures, LearnedFigures, TickInputs

TIMES_S = np.arange(2000) * 0.01


def doubt(rates_radps):
    """Variance (m/s²)² that these pitch rates, 100 a second, add to the accelerometer's bias in all."""
    covariance, before = np.zeros((STATES, STATES)), TickInputs()
    for rate in rates_radps:
        now = TickInputs(pitch_radps=rate)
        add_pitching_noise(covariance, before.array[0], now.array[0])
        before = now
    return float(covariance[ACCEL_BIAS, ACCEL_BIAS])


def test_pitching_adds_the_walk_of_such_rates_whatever_the_gyro_bias():
    rates = 0.1 * np.sin(2.0 * math.pi * 1.0 * TIMES_S)
    found = doubt(rates)
    passed = 0.59  # of the power at 1 Hz, by the means over 0.1 and 1 s
    assert found == pytest.approx(passed * 20.0 * 9.81**2 * 0.5 * 0.1**2 * 0.1, rel=0.12)
    assert doubt(0.02 + rates) == pytest.approx(found, rel=0.02)


def test_a_body_that_leans_without_pitching_may_rise_and_fall_as_much():
    covariance, now = np.zeros((STATES, STATES)), TickInputs(pitch_radps=0.0, waves_var=0.02)
    add_pitching_noise(covariance, TickInputs().array[0], now.array[0])
    assert covariance[ACCEL_BIAS, ACCEL_BIAS] == pytest.approx(0.02 * 0.01)


@pytest.mark.parametrize(
    "rates_radps",
    [
        0.03 + np.random.default_rng(1).normal(0.0, 0.01, 2000),  # bias, and noise four times the data sheet's
        0.1 * np.sin(2.0 * math.pi * 25.0 * TIMES_S),  # motors
        np.where((TIMES_S > 5.0) & (TIMES_S < 8.0), 0.02, 0.0),  # cross axis of a cheap gyro in a curve at 1 rad/s
        np.full(2000, math.nan),  # no gyro
    ],
    ids=["noise", "vibration", "curve", "none"],
)
def test_nothing_less_is_pitching(rates_radps):
    assert doubt(rates_radps) == 0.0


def slope_after(roll_mps2, sway_rad):
    """Learned figures after half a minute at 1 m/s, with this reading of the left axis at each sample."""
    figures = FilterFigures(side_bias_var=0.2**2, rise_var=0.2**2, r_side=0.026**2)
    learned = LearnedFigures()
    start_learning(figures, learned)
    state = np.zeros(STATES)
    state[SPEED] = 1.0
    for roll, sway in zip(roll_mps2, sway_rad, strict=True):
        state[HEADING] = sway
        _learn_slope(state, TickInputs(side_mps2=roll).array[0], figures.array[0], learned.array[0])
    return learned


def test_waves_that_sway_the_heading_teach_no_slope():
    """Waves of 2 cm and 1.6 m lean the robot by 17 mrad, and sway its heading by 6 mrad in step."""
    phase = 2.0 * math.pi * 0.6 * 0.08 * np.arange(375)
    found = slope_after(0.17 * np.sin(phase), 0.006 * np.sin(phase))
    assert abs(found.rise_east_mps2) < 3.0 * math.sqrt(found.east_var)
    inputs = TickInputs()
    store_learned(found.array[0], inputs.array[0])
    assert 0.3 * 0.17**2 < inputs.waves_var < 0.9 * 0.17**2


def test_smooth_ground_has_no_waves():
    found = slope_after(np.random.default_rng(1).normal(0.1, 0.018, 375), np.linspace(0.0, math.pi, 375))
    inputs = TickInputs()
    store_learned(found.array[0], inputs.array[0])
    assert inputs.waves_var == 0.0
