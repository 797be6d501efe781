"""Fixes of the tail are weighed down and no reason to stop; fixes that no honest receiver gives are a contradiction."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks._data_sheets import data_sheets
from tests.onboard.driven import drive, error, under_way, wander
from tests.onboard.rig import Rig
from tests.two_wheels import STANDSTILL
from touchline.onboard import filter_model as m
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.estimation import tail
from touchline.onboard.estimation.filter import Estimator
from touchline.onboard.estimation.noise import noise_figures
from touchline.schemas.scenario import GnssNoise, Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.sensors.gnss_truth import white

SCENARIO = Scenario()
VARIANCE_M2 = GnssNoise.white_tail().white_m ** 2
NU = m.FIX_DOF
FIGURES = noise_figures(Vehicle(), data_sheets(SCENARIO), drive_of(Vehicle()))


def weighed(y_m: float, sigma_m: float, variance_m2: float = VARIANCE_M2) -> float:
    """The variance with which a fix is used that is off by so much east, where the position's σ is that."""
    covariance, rows = np.zeros((m.STATES, m.STATES)), np.zeros((2, m.STATES))
    covariance[m.EAST, m.EAST] = covariance[m.NORTH, m.NORTH] = sigma_m**2
    rows[0, m.EAST] = rows[1, m.NORTH] = 1.0
    return float(tail.weighed_variance(covariance, rows, (y_m, 0.0), variance_m2, NU))


def settled(seed: int = 4) -> tuple[Rig, Estimator]:
    rig, estimator = under_way(seed=seed, ticks=1000)
    drive(rig, estimator, 100, lambda _: STANDSTILL)
    return rig, estimator


def test_the_model_of_the_receiver_has_the_published_quantiles() -> None:
    """7/17/38 mm of 68.27/95.45/99.73 %: those of a bivariate t, of which the first sets the scale."""
    from scipy.integrate import quad  # here: few workers need it

    shares = np.array([0.6827, 0.9545, 0.9973])
    radii = np.sqrt((1.0 - shares) ** (-2.0 / NU) - 1.0)
    assert 7.0 * radii / radii[0] == pytest.approx([7.0, 17.0, 38.0], rel=0.07)
    variance = NU / (NU - 2.0)  # of a scale of 1
    for radius in (1.0, 3.0, 10.0):
        beyond, _ = quad(lambda r: r * (1.0 + r * r / NU) ** (-NU / 2.0 - 1.0), radius, math.inf)
        assert tail.likelihood(radius**2 / variance, NU) == pytest.approx(beyond, rel=1e-6)


def test_a_weight_is_the_fixed_point_of_its_formula_and_an_outlier_counts_for_next_to_nothing() -> None:
    scale = VARIANCE_M2 * (NU - 2.0) / NU
    for y_m, sigma_m in ((0.0, 0.002), (0.01, 0.002), (0.05, 0.002), (1.0, 0.002)):
        used = weighed(y_m, sigma_m)
        residual, left = y_m * used / (sigma_m**2 + used), 2.0 * sigma_m**2 * used / (sigma_m**2 + used)
        assert used == pytest.approx(scale * (NU + (residual**2 + left) / scale) / (NU + 2.0), rel=0.01)
    assert weighed(0.0, 1e-6) == pytest.approx(scale * NU / (NU + 2.0), rel=1e-3)
    moves_m = [y * 0.002**2 / (0.002**2 + weighed(y, 0.002)) for y in (0.005, 0.01, 0.03, 0.1, 1.0)]
    assert moves_m[2:] == sorted(moves_m[2:], reverse=True), "the wilder it is, the less it moves"
    assert max(moves_m) < 0.002 and moves_m[-1] < 5e-5
    assert weighed(0.15, 0.1) < 4.0 * scale, "the position is not known: the fix is believed"


def test_a_mean_square_of_weighed_innovations_is_two() -> None:
    rng = np.random.default_rng(2)
    kinds = rng.chisquare(NU, 50_000) / (NU - 2.0)
    nis = (rng.standard_normal((2, 50_000)) ** 2).sum(axis=0) / kinds
    assert np.mean(tail.bounded.py_func(nis, NU)) == pytest.approx(2.0, abs=0.02)
    assert tail.bounded(1e12, NU) == pytest.approx(NU + 2.0)


def test_no_run_of_honest_fixes_contradicts() -> None:
    """Some 100,000 fixes of the emulated receiver, about three hours at 10 Hz; every fourteenth is outlying."""
    doubt = worst = outlying = 0.0
    for tick in range(100_000):
        nis = white(5, tick, 0) ** 2 + white(5, tick, 1) ** 2
        doubt = tail.doubt(doubt, tail.likelihood(nis, NU), 1.0)
        worst, outlying = max(worst, doubt), outlying + (doubt > 0.0)
    assert 15.0 < worst < tail.CONTRADICTED
    assert outlying / 100_000 == pytest.approx(0.07, abs=0.02)


def test_no_burst_contradicts() -> None:
    """Three hours of a moving antenna at 10 Hz: errors of bursts, and between them nothing."""
    rng, errors, doubt, worst = np.random.default_rng(3), np.zeros(2), 0.0, 0.0
    left, ends = math.exp(-0.1), 1.0 - math.exp(-0.1 / 3.0)
    on = False
    for _ in range(100_000):
        on = rng.random() > ends if on else rng.random() < 0.1 * ends
        errors = (left * errors + math.sqrt(1.0 - left * left) * rng.normal(0.0, 0.0137, 2)) if on else np.zeros(2)
        nis = float(errors @ errors) / (FIGURES.burst_var + FIGURES.r_gnss)
        doubt = tail.doubt(doubt, tail.likelihood_in_burst(nis), FIGURES.fix_news)
        worst = max(worst, doubt)
    assert 5.0 < worst < 0.7 * tail.CONTRADICTED


@pytest.mark.parametrize(("offset_m", "fixes"), [(0.1, 20), (100.0, 3)])
def test_a_jump_is_a_contradiction_before_it_has_moved_the_robot_off_its_line(offset_m: float, fixes: int) -> None:
    rig, estimator = settled()
    before = error(rig, estimator)
    rig.fix_offset_m = (offset_m, 0.0)
    latency_s = SCENARIO.gnss.latency_s
    drive(rig, estimator, round(100 * latency_s) + 10 * fixes, lambda _: STANDSTILL)
    assert estimator.contradicted
    drive(rig, estimator, 1000, lambda _: STANDSTILL)
    assert estimator.contradicted, "the receiver is not believed because it insists"
    moved_m = np.hypot(*(error(rig, estimator) - before)[:2])
    assert moved_m < 0.008
    rig.fix_offset_m = (0.0, 0.0)
    drive(rig, estimator, 50, lambda _: STANDSTILL)
    assert not estimator.contradicted


def test_one_wild_fix_or_two_are_no_contradiction() -> None:
    rig, estimator = settled()
    for _ in range(5):
        rig.fix_offset_m = (50.0, 0.0)
        drive(rig, estimator, 20, lambda _: STANDSTILL)
        rig.fix_offset_m = (0.0, 0.0)
        drive(rig, estimator, 20, lambda _: STANDSTILL)
        assert not estimator.contradicted
    drive(rig, estimator, 500, lambda t: wander(500 + t))
    assert np.hypot(*error(rig, estimator)[:2]) < 0.02


def test_a_start_from_a_fix_of_the_tail_is_mended_by_the_next_ones() -> None:
    for seed in range(3):
        rig = Rig(scenario=SCENARIO, seed=seed)
        estimator = Estimator(rig.vehicle, data_sheets(SCENARIO))
        while not estimator.started:
            rig.fix_offset_m = (0.045 if rig.tick < 25 else 0.0, 0.0)
            estimator.step(rig.step(STANDSTILL))
        assert abs(estimator.state[m.EAST] - rig.x) > 0.025
        drive(rig, estimator, 100, lambda _: STANDSTILL)
        assert not estimator.contradicted
        assert abs(estimator.state[m.EAST] - rig.x) < 0.02
