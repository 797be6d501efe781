"""The filter against a robot whose noise is its own model, and what it learns beside its states."""

import math

import numpy as np
from scipy.special import chdtri

from benchmarks._data_sheets import data_sheets
from benchmarks._matched_robot import MatchedRobot
from benchmarks.estimator import DEFAULT, VEHICLE, WHITE, EmulatedRobot, error, straight, wander
from touchline.onboard.estimation.filter import Estimator

RUNS = 6


def test_matched_noise_leaves_no_bias_and_the_right_spread() -> None:
    """Noise of the encoders must not make the estimate lag along the track, as it does when it gets into the gains."""
    nees, nis, along = [], [], []
    for seed in range(RUNS):
        robot, estimator = MatchedRobot(VEHICLE, WHITE, seed), Estimator(VEHICLE, data_sheets(WHITE))
        for tick in range(1, 2401):
            estimator.step(robot.step(*wander(tick)))
            if tick >= 1200 and tick % 100 == 0:
                e, heading = error(robot.pose, estimator.state), robot.heading
                nees.append(e @ np.linalg.solve(estimator.pose_covariance, e))
                nis.append(estimator.counters.fix_nis_last)
                along.append(e[0] * math.cos(heading) + e[1] * math.sin(heading))
    low, high = chdtri(3 * RUNS, [0.995, 0.005]) / RUNS
    assert low < np.mean(nees) < high
    low, high = chdtri(2 * len(nis), [0.995, 0.005]) / len(nis)
    assert low < np.mean(nis) < high
    assert abs(np.mean(along)) < 1e-3


def test_the_mean_slip_is_learned_so_an_outage_ends_within_3_sigma() -> None:
    """Rolling resistance takes half a per cent of the distance on the emulated grass: 15 cm of the 30 m."""
    bound, inside, along = chdtri(2, 0.0027), 0, []
    for seed in range(1, RUNS + 1):
        robot, estimator = EmulatedRobot(DEFAULT, seed), Estimator(VEHICLE, data_sheets(DEFAULT))
        for tick in range(1, 5501):
            robot.silent = tick > 2500
            estimator.step(robot.step(*straight(tick)))
        e, heading = error(robot.pose, estimator.state), robot.pose[2]
        inside += bool(e[:2] @ np.linalg.solve(estimator.pose_covariance[:2, :2], e[:2]) <= bound)
        along.append(e[0] * math.cos(heading) + e[1] * math.sin(heading))
    assert inside == RUNS
    assert abs(np.mean(along)) < 0.07
