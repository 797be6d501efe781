"""The estimator's knowledge at its start, and anew when the operator has it believe a receiver that jumped.

What is known of the errors of a fix says what must come out: less its slow error a fix is off by its white noise (by
twice its σ, since one alone may be of the tail), and what a fix says of the antenna holds for the antenna, however
little is known of the heading that carries it.
"""

from __future__ import annotations

import copy
import math

import numpy as np
import pytest

from benchmarks._data_sheets import data_sheets
from tests.onboard.driven import drive, error, under_way, until_fix, wander
from tests.onboard.rig import Rig
from tests.two_wheels import STANDSTILL
from touchline.onboard import filter_model as m
from touchline.onboard.estimation.aiding.gnss_aiding import POSITION_FLOOR_M
from touchline.onboard.estimation.filter import Estimator
from touchline.onboard.interface import Command
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle

SCENARIO = Scenario()
SHEET = data_sheets(SCENARIO).gnss
WHITE_VAR_M2 = 4.0 * POSITION_FLOOR_M**2
SLOW_VAR_M2 = SHEET.gauss_markov_1_m**2
WANDER_VAR_M2 = SHEET.gauss_markov_2_m**2
LEVER = Vehicle(body={"gnss_antenna_x_m": 0.5, "gnss_antenna_y_m": -0.3})
OFFSET = (0.6, -0.8)


def jumped(vehicle: Vehicle, rejected: int = 40) -> tuple[Rig, Estimator]:
    """One that has driven, stands, and has since had so many outlying fixes."""
    rig = Rig(vehicle=vehicle, scenario=SCENARIO, seed=4, heading=1.0)
    estimator = Estimator(vehicle, data_sheets(SCENARIO))
    drive(rig, estimator, 1000)
    drive(rig, estimator, 100, lambda _: STANDSTILL)
    rig.fix_offset_m = OFFSET if rejected else (0.0, 0.0)
    while estimator.counters.fixes_outlying_run < rejected:
        estimator.step(rig.step(STANDSTILL))
    return rig, estimator


def antenna_variance_m2(estimator: Estimator, vehicle: Vehicle) -> np.ndarray:
    """(2,) of the antenna's place, by the covariance of the axle's and the heading."""
    cos, sin = math.cos(estimator.state[m.HEADING]), math.sin(estimator.state[m.HEADING])
    x, y = vehicle.body.gnss_antenna_x_m, vehicle.body.gnss_antenna_y_m
    rows = np.zeros((2, m.STATES))
    rows[0, [m.EAST, m.HEADING]] = 1.0, -(sin * x + cos * y)
    rows[1, [m.NORTH, m.HEADING]] = 1.0, cos * x - sin * y
    return np.diag(rows @ estimator.covariance @ rows.T)


def expect_what_one_fix_tells(estimator: Estimator, vehicle: Vehicle) -> None:
    p = estimator.covariance
    assert np.allclose(p, p.T, rtol=1e-12, atol=1e-18)
    assert np.linalg.eigvalsh(p[: m.VARYING, : m.VARYING]).min() > 0.0
    assert antenna_variance_m2(estimator, vehicle) == pytest.approx(
        [WHITE_VAR_M2 + WANDER_VAR_M2 + SLOW_VAR_M2] * 2, rel=0.02
    )
    if vehicle is LEVER:  # where the axle's place has a third cause, the heading
        return
    for axis, slow in ((m.EAST, m.GNSS_EAST), (m.NORTH, m.GNSS_NORTH)):
        assert p[slow, slow] == pytest.approx(WANDER_VAR_M2, rel=0.02)
        fix = p[axis, axis] + p[slow, slow] + 2.0 * p[axis, slow]
        assert fix == pytest.approx(WHITE_VAR_M2 + SLOW_VAR_M2, rel=0.02)


@pytest.mark.parametrize("vehicle", [Vehicle(), LEVER], ids=["above the axle", "beside it"])
def test_a_start_knows_what_one_fix_tells(vehicle: Vehicle) -> None:
    rig = Rig(vehicle=vehicle, scenario=SCENARIO, seed=2, heading=2.0)
    estimator = Estimator(vehicle, data_sheets(SCENARIO))
    while not estimator.started:
        estimator.step(rig.step(STANDSTILL))
    expect_what_one_fix_tells(estimator, vehicle)


@pytest.mark.parametrize("vehicle", [Vehicle(), LEVER], ids=["above the axle", "beside it"])
def test_an_accepted_jump_is_known_as_well_as_one_fix_tells_it(vehicle: Vehicle) -> None:
    rig, estimator = jumped(vehicle)
    before = estimator.state.copy()
    estimator.accept_jump()
    expect_what_one_fix_tells(estimator, vehicle)
    assert error(rig, estimator)[:2] == pytest.approx(OFFSET, abs=0.03)
    assert (estimator.state[[m.GNSS_EAST, m.GNSS_NORTH]] == 0.0).all(), "what was known of it is void"
    for stays in (m.HEADING, m.GYRO_BIAS, m.ACCEL_BIAS, m.ODOMETRY_ERROR, m.ODOMETRY_ERROR + 1, m.MAG_BIAS):
        assert estimator.state[stays] == before[stays]
    drive(rig, estimator, 300, lambda _: STANDSTILL)
    assert estimator.counters.fixes_outlying_run == 0
    drive(rig, estimator, 600, lambda t: wander(500 + t))
    assert error(rig, estimator)[:2] == pytest.approx(OFFSET, abs=0.03)


def test_a_jump_is_told_from_an_estimate_that_drifts_away() -> None:
    _, estimator = jumped(Vehicle())
    jump = estimator.accept_jump()
    assert jump.of_receiver
    assert jump.seen_m == pytest.approx(math.hypot(*OFFSET), abs=0.05)
    rig, estimator = jumped(Vehicle(), rejected=0)
    for fixes in range(200):  # of a receiver that moves by 5 mm from one to the next
        rig.fix_offset_m = (0.005 * fixes, 0.0)
        drive(rig, estimator, 10, lambda _: STANDSTILL)
        if estimator.contradicted and estimator.counters.fixes_outlying_run >= 15:
            break
    drift = estimator.accept_jump()
    assert not drift.of_receiver
    assert drift.seen_m < 0.4 * drift.moved_m


def test_a_jump_accepted_while_driving_counts_what_was_driven_since_the_fix() -> None:
    rig, estimator = jumped(Vehicle())
    drive(rig, estimator, 300, lambda _: Command((7.0, 7.0), False, False))
    assert estimator.state[m.SPEED] * SCENARIO.gnss.latency_s > 0.07
    estimator.accept_jump()
    assert error(rig, estimator)[:2] == pytest.approx(OFFSET, abs=0.03)


def test_what_comes_late_from_before_a_jump_does_not_undo_it() -> None:
    rig, estimator = jumped(Vehicle())
    frames = [rig.step(STANDSTILL) for _ in range(5)]
    for frame in frames[:-1]:
        estimator.step(frame._replace(imu_age_ticks=5, encoder_age_ticks=5))  # nothing new of either
    estimator.accept_jump()
    accepted = estimator.state.copy()
    late = frames[0]._replace(tick=frames[-1].tick, time_s=frames[-1].time_s, imu_age_ticks=4, encoder_age_ticks=4)
    estimator.step(late)
    assert estimator.state[:2] == pytest.approx(accepted[:2], abs=0.01)


def test_it_takes_a_second_and_a_half_to_tell_a_jump_from_outliers() -> None:
    rig, estimator = jumped(Vehicle(), rejected=14)
    assert estimator.jump_m == 0.0
    while estimator.counters.fixes_outlying_run < 15:
        estimator.step(rig.step(STANDSTILL))
    assert estimator.jump_m == pytest.approx(1.0, abs=0.05)
    rig.fix_offset_m = (0.0, 0.0)
    drive(rig, estimator, 30, lambda _: STANDSTILL)
    assert estimator.jump_m == 0.0


def test_a_fix_that_admits_trouble_counts_for_less() -> None:
    """Of two that are off by the same 2 cm, the one that admits 10 cm moves the estimate by far less."""

    def moved(variance_m2: float | None) -> float:
        rig, estimator = under_way(seed=6, ticks=1000)
        frame = until_fix(rig, estimator, wander(1000))
        (fix,) = frame.gnss
        right, off = copy.deepcopy(estimator), estimator
        told = fix._replace(variance_m2=variance_m2 or fix.variance_m2)
        right.step(frame._replace(gnss=(told,)))
        off.step(frame._replace(gnss=(told._replace(east_m=fix.east_m + 0.02),)))
        return float(off.state[m.EAST] - right.state[m.EAST])

    assert 0.0 < moved(0.01) < 0.05 * moved(None)
