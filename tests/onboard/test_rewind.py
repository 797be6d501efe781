"""The filter with samples that are late, between ticks, disturbed or over-confident."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import chdtri

from benchmarks._data_sheets import data_sheets
from tests.onboard.driven import under_way, wander
from tests.onboard.rig import Rig
from tests.two_wheels import STANDSTILL
from touchline.onboard import filter_model as m
from touchline.onboard.drives.onboard_drive import drive_of, strain
from touchline.onboard.estimation.filter import Estimator
from touchline.onboard.estimation.report import report
from touchline.onboard.interface import Command, SensorFrame
from touchline.schemas.scenario import GnssNoise, Scenario
from touchline.schemas.vehicles import Vehicle

DEFAULT = Scenario()


def old(frame: SensorFrame, of: SensorFrame) -> SensorFrame:
    """A frame whose 100 Hz samples are those of an older one."""
    age = frame.tick - of.tick
    return frame._replace(
        imu=of.imu, encoders=of.encoders, mag=of.mag, imu_age_ticks=age, encoder_age_ticks=age, mag_age_ticks=age
    )


@pytest.mark.parametrize("late", [1, 7])
def test_late_samples_end_in_the_estimate_of_punctual_ones(late: int) -> None:
    """At the end both have got the same samples, and both have been without new ones for as long."""
    rig = Rig(scenario=DEFAULT, seed=21)
    frames = [rig.step(wander(tick)) for tick in range(900)]
    last = len(frames) - 1 - late
    punctual, delayed = Estimator(rig.vehicle, data_sheets(DEFAULT)), Estimator(rig.vehicle, data_sheets(DEFAULT))
    for i, frame in enumerate(frames):
        punctual.step(frame if i <= last else old(frame, frames[last]))
        delayed.step(old(frame, frames[i - late]) if i >= 400 else frame)
    assert report(delayed.counters).fixes == report(punctual.counters).fixes
    np.testing.assert_allclose(delayed.state, punctual.state, rtol=0, atol=1e-9)
    np.testing.assert_allclose(delayed.covariance, punctual.covariance, rtol=1e-6, atol=1e-12)


def test_a_fix_counts_for_its_own_fraction_of_a_tick() -> None:
    """At 1.4 m/s half a tick is 7 mm."""
    scenario = Scenario(noise="none", gnss=GnssNoise(latency_s=0.11))
    rig = Rig(scenario=scenario)
    estimator = Estimator(rig.vehicle, data_sheets(scenario))
    for tick in range(2000):
        frame = rig.step(STANDSTILL if tick < 80 else Command((14.0, 14.0), False, False))
        if tick > 400:
            later = [fix._replace(stamp_s=fix.stamp_s + 0.005, east_m=fix.east_m + 0.007) for fix in frame.gnss]
            frame = frame._replace(gnss=tuple(later))
        estimator.step(frame)
    assert math.hypot(estimator.state[m.EAST] - rig.x, estimator.state[m.NORTH] - rig.y) < 1e-3


def test_a_field_that_turns_at_once_is_rejected_and_counted() -> None:
    rig, estimator = under_way(seed=22, ticks=1500)
    before = estimator.state.copy()
    assert report(estimator.counters).mag_rejected == 0
    for tick in range(1500, 1600):
        frame = rig.step(wander(tick))
        mag = frame.mag
        estimator.step(frame._replace(mag=mag._replace(x_t=mag.y_t, y_t=-mag.x_t)))  # by a quarter turn
    assert report(estimator.counters).mag_rejected == 10
    assert abs(estimator.state[m.MAG_BIAS] - before[m.MAG_BIAS]) < 0.05
    assert abs(math.remainder(estimator.state[m.HEADING] - rig.heading, math.tau)) < 0.01


def test_wheels_and_magnetometer_say_how_well_they_agree() -> None:
    """Mean squares near their degrees of freedom: two for a pair of wheels, one for the magnetometer."""
    wheels, magnetic = [], []
    for seed in range(4):
        _, estimator = under_way(seed=seed, ticks=1500)
        said = report(estimator.counters)
        wheels.append(said.encoder_nis_mean)
        magnetic.append(said.mag_nis_mean)
    assert 0.5 < np.mean(wheels) < 2.2
    assert 0.25 < np.mean(magnetic) < 1.3


def test_a_float_solution_that_claims_too_much_is_not_believed() -> None:
    """It drifts off by 20 cm and claims 8 mm: the estimate does not follow it further than it says."""
    rig, estimator = under_way(seed=23, ticks=2000)
    rig.fix = 2
    for tick in range(2000, 4000):
        rig.fix_offset_m = (0.0001 * (tick - 2000), 0.0)
        estimator.step(rig.step(wander(tick)))
    off = abs(estimator.state[m.EAST] - rig.x)
    assert off < 3.0 * math.sqrt(estimator.covariance[m.EAST, m.EAST])
    assert off < 0.15


def test_gates_are_those_of_as_many_numbers_as_are_judged() -> None:
    assert pytest.approx(chdtri(2, 1e-4), abs=0.01) == m.GATE_2_DOF
    assert pytest.approx(chdtri(1, 1e-4), abs=0.01) == m.GATE_1_DOF


def test_a_slip_that_jumps_is_believed_after_ten_readings_and_a_short_one_is_no_slip_yet() -> None:
    """The slip test looks at 0.3 s: ten rejected readings of 10 ms are 1 − exp(−1/3) of it, less than the half."""
    rig = Rig(scenario=DEFAULT, seed=24)
    estimator = Estimator(rig.vehicle, data_sheets(DEFAULT))
    steady = Command((8.0, 8.0), False, False)
    for tick in range(1500):
        estimator.step(rig.step(STANDSTILL if tick < 80 else steady))
    rig.spin_share, seen = 0.08, []
    for _ in range(150):
        estimator.step(rig.step(steady))
        seen.append(report(estimator.counters).slip)
    assert 8 <= report(estimator.counters).encoders_rejected <= 20
    assert max(seen) == pytest.approx(1.0 - math.exp(-1.0 / 3.0), abs=0.05)
    assert abs(estimator.state[m.ODOMETRY_ERROR] - 0.08) < 0.03


def test_a_wheel_that_is_sped_up_slips_by_nobody_knows_how_much() -> None:
    """Of the tyres' slip 1 σ more for each m/s of change, but only where the accelerometer tells the speed."""

    def added(change_mps: float, accel: float) -> list[float]:
        before, now, covariance = m.TickInputs(), m.TickInputs(), np.zeros((m.STATES, m.STATES))
        before.odometry[:], now.odometry[:], now.smooth[:] = 0.0, 0.0, 0.0
        now.odometry[0], now.accel_mps2 = change_mps, accel
        strain(drive_of(Vehicle()).figures, covariance, before.array[0], now.array[0])
        return [math.sqrt(covariance[i, i]) for i in (m.ODOMETRY_ERROR, m.ODOMETRY_ERROR + 1)]

    assert added(0.0, 0.1) == [0.0, 0.0]
    assert added(0.02, 0.1) == pytest.approx([0.008, 0.0])
    assert added(0.02, math.nan) == [0.0, 0.0]
