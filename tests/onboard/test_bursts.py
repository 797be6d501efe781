"""Bursts of the receiver are told from motion, the estimate does not follow them, and it gives in where it is wrong."""

from __future__ import annotations

import math

import numpy as np

from tests.onboard.test_tail import FIGURES
from touchline.onboard import filter_model as m
from touchline.onboard.estimation.bursts import update_by_mode
from touchline.onboard.estimation.tail import BURST_SHARE
from touchline.onboard.estimation.tick_estimate import TickEstimate

WALK_M2 = 0.1 * 0.004**2
"""Variance of a tenth of a metre, at which there is a fix."""


class Standing:
    """A filter of the position only, of a robot that is at the origin."""

    def __init__(self) -> None:
        self.state, self.covariance, self.inputs = np.zeros(m.STATES), np.zeros((m.STATES, m.STATES)), m.TickInputs()
        self.places = [m.EAST, m.NORTH]
        self.covariance[self.places, self.places] = 0.002**2

    def take(self, east_m: float, north_m: float = 0.0) -> None:
        """Walk on to the next fix, and use it."""
        z, errors, kept = self.inputs, [m.GNSS_EAST, m.GNSS_NORTH], FIGURES.burst_decay**10
        z.switching = 1.0 - (1.0 - FIGURES.burst_change) ** 10
        burst = z.burst + z.switching * (BURST_SHARE - z.burst)
        self.state[errors] *= kept
        self.covariance[errors, :] *= kept
        self.covariance[:, errors] *= kept
        self.covariance[errors, errors] += burst * FIGURES.burst_var * (1.0 - kept**2)
        self.covariance[self.places, self.places] += WALK_M2
        rows = np.zeros((2, m.STATES))
        rows[0, m.EAST] = rows[0, m.GNSS_EAST] = rows[1, m.NORTH] = rows[1, m.GNSS_NORTH] = 1.0
        y = (east_m - rows[0] @ self.state, north_m - rows[1] @ self.state)
        fix = m.FixInTick(variance_m2=FIGURES.r_gnss)
        scratch = (rows, np.zeros(m.STATES), np.zeros((2, 1 + m.STATES, m.STATES)))
        at = TickEstimate(self.state, self.covariance, z.array[0])
        update_by_mode(at, fix.array[0], y, FIGURES.array[0], scratch)
        assert (self.covariance == self.covariance.T).all()
        assert np.linalg.eigvalsh(self.covariance).min() > -1e-12


def test_a_burst_moves_the_estimate_little_and_is_over_when_fixes_return() -> None:
    robot, rng = Standing(), np.random.default_rng(1)
    for _ in range(50):
        robot.take(*rng.normal(0.0, 0.001, 2))
    assert robot.inputs.burst < 0.02
    for k in range(20):
        robot.take(0.02 + 0.005 * (-1) ** k, rng.normal(0.0, 0.005))
    assert robot.inputs.burst > 0.9
    assert abs(robot.state[m.EAST]) < 0.006
    for _ in range(5):
        robot.take(*rng.normal(0.0, 0.001, 2))
    assert robot.inputs.burst < 0.1
    assert abs(robot.state[m.EAST]) < 0.002


def test_a_slow_slide_of_the_robot_is_no_burst() -> None:
    robot, rng = Standing(), np.random.default_rng(2)
    for metres in np.arange(0.0, 10.0, 0.1):
        robot.take(0.003 * metres + rng.normal(0.0, 0.001), rng.normal(0.0, 0.001))
    assert robot.inputs.burst < 0.05
    assert abs(robot.state[m.EAST] - 0.03) < 0.003


def test_a_wrong_place_is_not_taken_for_a_lasting_burst() -> None:
    for sigma_m in (0.002, 0.012):
        robot, rng = Standing(), np.random.default_rng(3)
        robot.covariance[robot.places, robot.places] = sigma_m**2
        robot.inputs.burst = 0.95
        for _ in range(100):
            robot.take(0.025 + rng.normal(0.0, 0.001), rng.normal(0.0, 0.001))
        assert robot.inputs.burst < 0.1
        assert abs(robot.state[m.EAST] - 0.025) < 0.004


def test_a_position_that_is_not_known_may_be_that_of_a_burst() -> None:
    robot = Standing()
    robot.covariance[robot.places, robot.places] = 1.0
    robot.inputs.burst = 0.091
    robot.take(0.3)
    sigma_m = math.sqrt(robot.covariance[m.EAST, m.EAST])
    assert 0.8 * 0.091**0.5 < sigma_m / FIGURES.burst_var**0.5 < 1.2 * 0.12**0.5
