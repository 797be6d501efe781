"""The EKF against truth: consistent, not fooled by latency or outliers, and the same from any order of fixes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import chdtri

from benchmarks._data_sheets import data_sheets
from tests.onboard.driven import drive, error, under_way, until_fix, wander
from tests.onboard.rig import Rig
from tests.two_wheels import STANDSTILL
from touchline.onboard import filter_model as m
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.estimation.filter import Estimator
from touchline.onboard.estimation.noise import noise_figures
from touchline.onboard.estimation.report import report
from touchline.onboard.estimation.tail import bounded
from touchline.onboard.filter_model import FIX_DOF
from touchline.onboard.interface import Command, MagSample
from touchline.schemas.scenario import DriveNoise, GnssNoise, Scenario
from touchline.schemas.vehicles import Vehicle

DEFAULT = Scenario()
TAIL = Scenario(gnss=GnssNoise.white_tail())


def straight(tick: int) -> Command:
    return STANDSTILL if tick < 80 else Command((10.0, 10.0), False, False)


def nees(rig: Rig, estimator: Estimator) -> float:
    e = error(rig, estimator)
    return float(e @ np.linalg.solve(estimator.pose_covariance, e))


def test_perfect_sensors_give_the_truth() -> None:
    rig = Rig(heading=2.0, x=30.0, y=-12.0)
    estimator = Estimator(rig.vehicle, data_sheets(rig.scenario))
    drive(rig, estimator, 3000)
    assert np.all(np.abs(error(rig, estimator)) < (1e-3, 1e-3, 1e-4))
    assert abs(estimator.speed_now_mps() - rig.speed) < 1e-3
    assert abs(estimator.state[m.YAW_RATE] - rig.yaw_rate) < 1e-2


def test_consistent_over_monte_carlo_runs() -> None:
    """NEES of (x, y, heading) not above its 99 % bound, nor absurdly low; NIS alike."""
    from scipy.integrate import quad  # here: few workers need it

    runs, samples, nis, heading = 5, [], [], []
    for seed in range(runs):
        rig = Rig(scenario=TAIL, seed=seed, heading=0.3 * seed)
        estimator = Estimator(rig.vehicle, data_sheets(TAIL))
        drive(rig, estimator, 1500)
        checks = []
        for _ in range(4):
            drive(rig, estimator, 500, lambda tick: wander(tick + 2000))
            checks.append(nees(rig, estimator))
            heading.append(error(rig, estimator)[2])
        samples.append(checks)
        nis.append(report(estimator.counters).fix_nis_mean)
    low, high = chdtri(3 * runs, [0.995, 0.005]) / runs
    means = np.mean(samples, axis=0)
    assert np.all(means < high), means
    assert np.all(means > 0.5 * low), means
    # The rig's fixes are normally distributed: what weighed squares then are in the mean.
    expected, _ = quad(lambda square: bounded(square, FIX_DOF) * 0.5 * math.exp(-0.5 * square), 0.0, math.inf)
    assert np.mean(nis) == pytest.approx(expected, abs=0.2)
    assert math.degrees(np.sqrt(np.mean(np.square(heading)))) < 0.3


def test_heading_is_found_on_the_run_in() -> None:
    """Five metres straight: heading from a few degrees of the magnetometer to what painting needs."""
    errors = []
    for seed in range(5):
        rig = Rig(scenario=DEFAULT, seed=seed, heading=1.0)
        estimator = Estimator(rig.vehicle, data_sheets(DEFAULT))
        drive(rig, estimator, 80, straight)
        assert estimator.heading_sigma_rad > math.radians(1.0)
        while math.hypot(rig.x, rig.y) < 5.0:
            estimator.step(rig.step(straight(100)))
        assert estimator.heading_sigma_rad < math.radians(0.5)
        errors.append(error(rig, estimator)[2])
    assert math.degrees(np.sqrt(np.mean(np.square(errors)))) < 0.5


def test_late_fixes_count_for_their_own_time() -> None:
    """At 1.4 m/s a delay of 110 ms taken for none would be 15 cm; here even the latency's size does not matter."""
    for latency in (0.0, 0.11, 0.3):
        scenario = Scenario(noise="none", gnss=GnssNoise(latency_s=latency))
        rig = Rig(scenario=scenario)
        estimator = Estimator(rig.vehicle, data_sheets(scenario))
        drive(rig, estimator, 2000, lambda t: STANDSTILL if t < 80 else Command((14.0, 14.0), False, False))
        assert np.hypot(*error(rig, estimator)[:2]) < 1e-3
        assert report(estimator.counters).fixes_rejected == 0


def test_lever_arm_is_taken_into_account() -> None:
    vehicle = Vehicle(body={"gnss_antenna_x_m": 0.3, "gnss_antenna_y_m": -0.2})
    rig = Rig(vehicle=vehicle, heading=0.7)
    estimator = Estimator(vehicle, data_sheets(rig.scenario))
    drive(rig, estimator, 2500, lambda t: STANDSTILL if t < 80 else Command((6.0, 9.0), False, False))
    assert np.hypot(*error(rig, estimator)[:2]) < 2e-3


def test_lost_samples_end_near_the_same_estimate() -> None:
    """Two of three readings of the IMU and the encoders."""

    def final(lost: bool) -> tuple[Estimator, Rig]:
        rig = Rig(scenario=DEFAULT, seed=11)
        estimator = Estimator(rig.vehicle, data_sheets(DEFAULT))
        frames = [rig.step(wander(tick)) for tick in range(1500)]
        for i, frame in enumerate(frames):
            age = i % 3 if lost and i > 600 else 0
            old = frames[i - age]
            estimator.step(
                frame._replace(
                    imu=old.imu, encoders=old.encoders, imu_age_ticks=age, encoder_age_ticks=age, mag_age_ticks=0
                )
            )
        return estimator, rig

    exact, rig = final(lost=False)
    other, _ = final(lost=True)
    assert np.all(np.abs(error(rig, other)) < (0.04, 0.04, 0.01))
    assert np.all(np.abs(other.state[:3] - exact.state[:3]) < (0.02, 0.02, 0.008))
    assert report(other.counters).encoders_rejected < 20


def test_duplicates_and_ancient_fixes_are_counted_and_ignored() -> None:
    rig, estimator = under_way(seed=7, ticks=500)
    frame = until_fix(rig, estimator, wander(600))
    (fix,) = frame.gnss
    estimator.step(frame)
    estimator.step(rig.step(wander(600))._replace(gnss=(fix,)))
    assert report(estimator.counters).fixes_duplicate == 1
    estimator.step(rig.step(wander(600))._replace(gnss=(fix._replace(stamp_s=fix.stamp_s - 2.0),)))
    estimator.step(rig.step(wander(600))._replace(gnss=(fix._replace(stamp_s=fix.stamp_s + 9.0),)))
    assert report(estimator.counters).fixes_too_late == 2


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_fix_that_is_not_a_number_is_ignored(bad: float) -> None:
    rig, estimator = under_way(seed=8, ticks=500)
    for _ in range(20):
        frame = rig.step(wander(600))
        frame = frame._replace(gnss=tuple(fix._replace(east_m=bad) for fix in frame.gnss))
        estimator.step(frame)
    assert np.all(np.isfinite(estimator.state))


def test_waits_for_standstill_and_a_fixed_position() -> None:
    rig = Rig(fix=2)
    estimator = Estimator(rig.vehicle, data_sheets(rig.scenario))
    drive(rig, estimator, 200, lambda t: STANDSTILL)
    assert not estimator.started and math.isinf(estimator.position_sigma_m)
    rig.fix = 3
    drive(rig, estimator, 200, lambda t: Command((5.0, 5.0), False, False))
    assert not estimator.started
    drive(rig, estimator, 200, lambda t: STANDSTILL)
    assert estimator.aligned


def test_it_does_not_start_before_anything_has_told_the_heading() -> None:
    rig = Rig(heading=2.0)
    estimator = Estimator(rig.vehicle, data_sheets(rig.scenario))
    silent = MagSample(0.0, 0.0, 0.0)
    drive(rig, estimator, 200, lambda t: STANDSTILL, lambda frame: frame._replace(mag=silent))
    assert not estimator.started
    drive(rig, estimator, 200, lambda t: STANDSTILL)
    assert estimator.aligned
    assert abs(estimator.state[m.HEADING] - 2.0) < 0.1


def test_after_a_restart_a_fix_from_the_old_place_is_not_used() -> None:
    scenario = Scenario(noise="none", gnss=GnssNoise(latency_s=0.45))
    rig = Rig(scenario=scenario)
    estimator = Estimator(rig.vehicle, data_sheets(scenario))
    drive(rig, estimator, 300, lambda t: STANDSTILL)
    rig.x, rig.y, rig.heading = 50.0, 20.0, 1.0
    estimator.restart()
    assert not estimator.started
    drive(rig, estimator, 300, lambda t: STANDSTILL)
    assert estimator.aligned
    assert np.all(np.abs(error(rig, estimator)) < 1e-3)
    assert report(estimator.counters).fixes_rejected == 0


def test_one_gauss_markov_term_keeps_variance_and_short_term_decay() -> None:
    c = noise_figures(Vehicle(), data_sheets(TAIL), drive_of(Vehicle()))
    assert c.gnss_var == pytest.approx(2 * 0.0025**2)
    tau = -0.01 / math.log(c.gnss_decay)
    assert tau == pytest.approx(2 / (1 / 115 + 1 / 900), rel=1e-6)
    assert c.slow_var == c.q_slow == c.burst_var == 0.0


def test_of_two_terms_that_are_far_apart_the_slow_one_is_considered() -> None:
    c = noise_figures(Vehicle(), data_sheets(DEFAULT), drive_of(Vehicle()))
    assert (c.gnss_var, c.slow_var) == pytest.approx((0.0047**2, 0.0043**2))
    assert -0.01 / math.log(c.gnss_decay) == pytest.approx(2.0)
    rig, estimator = under_way(seed=1, ticks=3000)
    covariance = estimator.covariance
    assert covariance[m.EAST, m.EAST] > 0.0043**2, "no number of fixes averages it out"
    assert np.linalg.eigvalsh(covariance).min() > 0.0
    assert math.hypot(*error(rig, estimator)[:2]) < 0.02


def test_covariance_stays_symmetric_and_positive() -> None:
    rig = Rig(scenario=Scenario(drive=DriveNoise(slip_relative=0.05)), seed=9)
    estimator = Estimator(rig.vehicle, data_sheets(DEFAULT))
    for _ in range(20):
        drive(rig, estimator, 300)
        p = estimator.covariance
        assert np.allclose(p, p.T, rtol=1e-9, atol=1e-15)
        assert np.linalg.eigvalsh(p).min() > 0.0


def test_a_gyro_that_turns_while_the_wheels_stand_makes_the_heading_uncertain() -> None:
    rig, estimator = under_way(seed=12, ticks=1000)
    drive(rig, estimator, 150, lambda t: STANDSTILL)
    bias, sigma = float(estimator.state[m.GYRO_BIAS]), estimator.heading_sigma_rad
    for _ in range(100):
        frame = rig.step(STANDSTILL)
        turned = frame.imu._replace(gyro_z_radps=frame.imu.gyro_z_radps + 0.3)
        estimator.step(frame._replace(imu=turned))
    assert report(estimator.counters).gyro_rejected == 100
    assert abs(estimator.state[m.GYRO_BIAS] - bias) < 1e-3
    assert estimator.heading_sigma_rad > 5.0 * sigma  # the magnetometer has a say, too
    assert abs(error(rig, estimator)[2]) < 3.0 * estimator.heading_sigma_rad


def test_a_frozen_imu_is_no_new_sample_once_the_wheels_change() -> None:
    rig, estimator = under_way(seed=13, ticks=1000)
    last = rig.step(wander(1000))
    estimator.step(last)
    for tick in range(60):
        estimator.step(rig.step(Command((10.0 - 0.1 * tick, 10.0), False, False))._replace(imu=last.imu))
    assert last.tick <= estimator.buffer.imu_tick < last.tick + 20
    assert abs(error(rig, estimator)[2]) < 0.1
