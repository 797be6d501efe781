"""Consistency of the estimator over Monte Carlo runs, beside a plain EKF on the same frames.

`python -m benchmarks estimator`; TOUCHLINE_RUNS sets the number of runs (100).
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from benchmarks._matched_robot import MatchedRobot
from benchmarks._plain_ekf import PlainEkf
from schemas.scenario import GnssNoise, Scenario
from schemas.vehicle import Vehicle
from services.robot_sim.frames import Command, SensorFrame
from services.robot_sim.onboard.estimator import model as m
from services.robot_sim.onboard.estimator.filter import Estimator
from services.robot_sim.sensors.suite import Sensors
from services.robot_sim.world import body
from services.robot_sim.world.world import World

STAND_TICKS = 90
CHECK_FROM, CHECK_TO, CHECK_EVERY = 1500, 4000, 100
OUTAGE_FROM, OUTAGE_TICKS = 2500, 3000
VEHICLE = Vehicle()
DEFAULT = Scenario()
WHITE = Scenario(gnss=GnssNoise(gauss_markov_1_m=0.0, gauss_markov_2_m=0.0))


class Robot(Protocol):
    """Something that moves and senses."""

    silent: bool

    @property
    def pose(self) -> tuple[float, float, float]: ...

    def step(self, speed: float, yaw_rate: float) -> SensorFrame: ...


class EmulatedRobot:
    """World and sensors of the emulator, wheels commanded open loop."""

    def __init__(self, scenario: Scenario, seed: int) -> None:
        scenario = scenario.model_copy(update={"seed": seed})
        self.world, self.sensors = World(VEHICLE, scenario), Sensors(VEHICLE, scenario)
        self.silent = False
        self._tick = 0

    @property
    def pose(self) -> tuple[float, float, float]:
        return tuple(self.world.state[body.EAST : body.EAST + 3].tolist())

    def step(self, speed: float, yaw_rate: float) -> SensorFrame:
        self._tick += 1
        rim = VEHICLE.half_track_m * yaw_rate
        left, right = (speed - rim) / VEHICLE.wheel_radius_m, (speed + rim) / VEHICLE.wheel_radius_m
        self.world.step(Command(left, right, False, False), self._tick)
        frame = self.sensors.read(self._tick, self.world.state)
        return frame._replace(gnss=()) if self.silent else frame


def wander(tick: int) -> tuple[float, float]:
    """Speed and yaw rate: stands, speeds up to 1 m/s, then bends."""
    if tick < STAND_TICKS:
        return 0.0, 0.0
    speed = min((tick - STAND_TICKS) * 0.01, 1.0)
    since = (tick - STAND_TICKS) / 100
    return speed, 0.5 * math.sin(0.4 * since) if since > 6.0 else 0.0


def straight(tick: int) -> tuple[float, float]:
    return wander(tick)[0], 0.0


def error(pose: tuple[float, float, float], x: NDArray[np.float64]) -> NDArray[np.float64]:
    east, north, heading = pose
    return np.array([x[0] - east, x[1] - north, math.remainder(x[2] - heading, math.tau)])


class Figures(NamedTuple):
    """Of many runs; NEES and NIS as (runs, checks)."""

    nees: NDArray[np.float64]
    nis: NDArray[np.float64]
    position_rmse_m: float
    heading_rmse_rad: float
    plain_nees: NDArray[np.float64]
    plain_position_rmse_m: float
    plain_heading_rmse_rad: float


def monte_carlo(make: Callable[[int], Robot], scenario: Scenario, runs: int) -> Figures:
    """Both filters on the same frames of many robots."""
    nees, nis, errors, plain_nees, plain_errors = [], [], [], [], []
    for seed in range(1, runs + 1):
        robot, estimator, plain = make(seed), Estimator(VEHICLE, scenario), PlainEkf(VEHICLE)
        rows: list[list[float]] = [[], [], []]
        for tick in range(1, CHECK_TO + 1):
            frame = robot.step(*wander(tick))
            estimator.step(frame)
            plain.step(frame)
            if tick >= CHECK_FROM and (tick - CHECK_FROM) % CHECK_EVERY == 0:
                e, p = error(robot.pose, estimator.state), error(robot.pose, plain.state)
                rows[0].append(float(e @ np.linalg.solve(estimator.covariance[:3, :3], e)))
                rows[1].append(float(estimator.counters[m.NIS_FIX_LAST]))
                rows[2].append(float(p @ np.linalg.solve(plain.covariance, p)))
                errors.append(e)
                plain_errors.append(p)
        nees.append(rows[0])
        nis.append(rows[1])
        plain_nees.append(rows[2])
    e, p = np.array(errors), np.array(plain_errors)
    return Figures(
        np.array(nees),
        np.array(nis),
        float(np.sqrt((e[:, :2] ** 2).sum(axis=1).mean())),
        float(np.sqrt((e[:, 2] ** 2).mean())),
        np.array(plain_nees),
        float(np.sqrt((p[:, :2] ** 2).sum(axis=1).mean())),
        float(np.sqrt((p[:, 2] ** 2).mean())),
    )


def outages(make: Callable[[int], Robot], runs: int) -> tuple[float, float, float, float]:
    """Share of runs within 3 σ after 30 s without fixes at 1 m/s, and the median error; ours, then the plain one's."""
    inside = plain_inside = 0
    lengths, plain_lengths = [], []
    bound = chi2.ppf(0.9973, 2)
    for seed in range(1, runs + 1):
        robot, estimator, plain = make(seed), Estimator(VEHICLE, DEFAULT), PlainEkf(VEHICLE)
        for tick in range(1, OUTAGE_FROM + OUTAGE_TICKS + 1):
            robot.silent = tick > OUTAGE_FROM
            frame = robot.step(*straight(tick))
            estimator.step(frame)
            plain.step(frame)
        e, p = error(robot.pose, estimator.state)[:2], error(robot.pose, plain.state)[:2]
        inside += bool(e @ np.linalg.solve(estimator.covariance[:2, :2], e) <= bound)
        plain_inside += bool(p @ np.linalg.solve(plain.covariance[:2, :2], p) <= bound)
        lengths.append(float(np.hypot(*e)))
        plain_lengths.append(float(np.hypot(*p)))
    return inside / runs, float(np.median(lengths)), plain_inside / runs, float(np.median(plain_lengths))


def _say(name: str, figures: Figures, runs: int) -> None:
    low3, high3 = chi2.ppf([0.025, 0.975], 3 * runs) / runs
    low2, high2 = chi2.ppf([0.025, 0.975], 2 * runs) / runs
    nees, nis = figures.nees.mean(axis=0), figures.nis.mean(axis=0)
    print(f"{name}, {runs} runs of {CHECK_TO / 100:.0f} s")
    print(f"  NEES of the pose  {nees.mean():8.2f}   95 % bounds {low3:.2f} to {high3:.2f} (3 states)")
    print(f"      of its {nees.size} instants {np.mean(nees > high3):.0%} are above, {np.mean(nees < low3):.0%} below")
    print(f"  NIS of the fixes  {nis.mean():8.2f}   95 % bounds {low2:.2f} to {high2:.2f} (2 numbers)")
    print(f"      of its {nis.size} instants {np.mean(nis > high2):.0%} are above, {np.mean(nis < low2):.0%} below")
    print(f"  position RMSE     {figures.position_rmse_m * 1e3:8.1f} mm")
    print(f"  heading RMSE      {math.degrees(figures.heading_rmse_rad):8.3f} °")
    position, heading = figures.plain_position_rmse_m * 1e3, math.degrees(figures.plain_heading_rmse_rad)
    print(
        f"  plain 3-state EKF: NEES {figures.plain_nees.mean():.1f}, position {position:.1f} mm, heading {heading:.3f}°"
    )


def main() -> None:
    """Print the figures."""
    runs = int(os.environ.get("TOUCHLINE_RUNS", "100"))
    cases: tuple[tuple[str, Callable[[int], Robot], Scenario], ...] = (
        ("matched noise, fixes white", lambda seed: MatchedRobot(VEHICLE, WHITE, seed), WHITE),
        ("matched noise, slow GNSS error", lambda seed: MatchedRobot(VEHICLE, DEFAULT, seed), DEFAULT),
        ("emulated robot, fixes white", lambda seed: EmulatedRobot(WHITE, seed), WHITE),
        ("emulated robot, default noise", lambda seed: EmulatedRobot(DEFAULT, seed), DEFAULT),
    )
    for name, make, scenario in cases:
        _say(name, monte_carlo(make, scenario, runs), runs)
    inside, median, plain_inside, plain_median = outages(lambda seed: EmulatedRobot(DEFAULT, seed), runs)
    print(f"30 s without fixes at 1 m/s, {runs} runs: within 3 σ in {inside:.0%}, median error {median:.2f} m")
    print(f"  plain 3-state EKF: within 3 σ in {plain_inside:.0%}, median error {plain_median:.2f} m")
