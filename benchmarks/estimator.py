"""Consistency of the estimator over Monte Carlo runs, beside a plain EKF on the same frames.

`python -m benchmarks estimator`; `runs` are made of each case.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from benchmarks._data_sheets import data_sheets
from benchmarks._matched_robot import MatchedRobot
from benchmarks._plain_ekf import PlainEkf
from benchmarks._settings import Small
from touchline.onboard.estimation.filter import Estimator
from touchline.onboard.interface import Command, SensorFrame
from touchline.schemas.scenario import GnssNoise, Ground, Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.sensors.suite import Sensors
from touchline.services.robot_sim.world.world import World

STAND_TICKS = 90
CHECK_FROM, CHECK_TO, CHECK_EVERY = 1500, 4000, 100
OUTAGE_FROM, OUTAGE_TICKS = 2500, 3000
VEHICLE = Vehicle()
DEFAULT = Scenario()
WHITE = Scenario(gnss=GnssNoise(white_m=0.00471, gauss_markov_1_m=0.0, burst_share=0.0))
SLOPE = Scenario(ground=Ground(grade=0.02, uphill_rad=1.0))
SMALL = Small(
    {"runs": 1},
    (
        "matched, white fixes: # runs of # s",
        "NEES of the pose, mean of runs and instants # # to #",
        "NIS: instants whose mean is within # % at least #",
        "heading RMSE # ° at most #",
        "runs within the 3 σ that are reported # % at least #",
        "emulated, slope of 2 % # # mm #° | # # mm #°",
        "30 s without fixes #% # m | #% # m",
        "# of # hold",
    ),
)


class Robot(Protocol):
    """Interface of robots that move and sense."""

    silent: bool

    @property
    def pose(self) -> tuple[float, float, float]: ...

    def step(self, speed: float, yaw_rate: float) -> SensorFrame: ...


class EmulatedRobot:
    """World and sensors of the emulator, actuators commanded open loop."""

    def __init__(self, scenario: Scenario, seed: int, vehicle: Vehicle = VEHICLE) -> None:
        scenario = scenario.model_copy(update={"seed": seed})
        self.world, self.sensors = World(vehicle, scenario), Sensors(vehicle, scenario)
        self.silent = False
        self._tick = 0

    @property
    def pose(self) -> tuple[float, float, float]:
        return self.world.pose

    def step(self, speed: float, yaw_rate: float) -> SensorFrame:
        rim = VEHICLE.drive.half_track_m * yaw_rate
        left, right = (speed - rim) / VEHICLE.drive.wheel_radius_m, (speed + rim) / VEHICLE.drive.wheel_radius_m
        return self.command(left, right)

    def command(self, *actuators: float) -> SensorFrame:
        self._tick += 1
        self.world.step(Command(actuators, False, False), self._tick)
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
    """Figures of many runs; NEES and NIS as (runs, checks)."""

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
        robot, estimator, plain = make(seed), Estimator(VEHICLE, data_sheets(scenario)), PlainEkf(VEHICLE)
        rows: list[list[float]] = [[], [], []]
        for tick in range(1, CHECK_TO + 1):
            frame = robot.step(*wander(tick))
            estimator.step(frame)
            plain.step(frame)
            if tick >= CHECK_FROM and (tick - CHECK_FROM) % CHECK_EVERY == 0:
                e, p = error(robot.pose, estimator.state), error(robot.pose, plain.state)
                rows[0].append(float(e @ np.linalg.solve(estimator.pose_covariance, e)))
                rows[1].append(float(estimator.counters.fix_nis_last))
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
    bound = chdtri(2, 1.0 - 0.9973)
    for seed in range(1, runs + 1):
        robot, estimator, plain = make(seed), Estimator(VEHICLE, data_sheets(DEFAULT)), PlainEkf(VEHICLE)
        for tick in range(1, OUTAGE_FROM + OUTAGE_TICKS + 1):
            robot.silent = tick > OUTAGE_FROM
            frame = robot.step(*straight(tick))
            estimator.step(frame)
            plain.step(frame)
        e, p = error(robot.pose, estimator.state)[:2], error(robot.pose, plain.state)[:2]
        inside += bool(e @ np.linalg.solve(estimator.pose_covariance[:2, :2], e) <= bound)
        plain_inside += bool(p @ np.linalg.solve(plain.covariance[:2, :2], p) <= bound)
        lengths.append(float(np.hypot(*e)))
        plain_lengths.append(float(np.hypot(*p)))
    return inside / runs, float(np.median(lengths)), plain_inside / runs, float(np.median(plain_lengths))


class Check(NamedTuple):
    """A figure and the bounds that it has to be within."""

    what: str
    figure: float
    low: float
    high: float
    unit: str = ""

    @property
    def holds(self) -> bool:
        """True if the figure is within its bounds."""
        return self.low <= self.figure <= self.high

    def __str__(self) -> str:
        bounds = f"{self.low:.2f} to {self.high:.2f}" if math.isfinite(self.high) else f"at least {self.low:.2f}"
        if self.low == 0.0:
            bounds = f"at most {self.high:.2f}"
        return f"  {self.what:44s}{self.figure:8.2f}{self.unit:3s} {bounds:16s} {'pass' if self.holds else 'FAIL'}"


def _bounds(degrees: int, runs: int) -> tuple[float, float]:
    """95 % bounds of the mean over `runs` of a χ² with `degrees` of freedom."""
    low, high = (float(chdtri(degrees * runs, share)) / runs for share in (0.975, 0.025))
    return low, high


def checks(figures: Figures, runs: int, *, matched: bool) -> list[Check]:
    """Checks of a case. With noise that differs from its model the filter may be cautious, but not over-confident."""
    pose, fixes = _bounds(3, runs), _bounds(2, runs)
    nees, nis = figures.nees.mean(axis=0), figures.nis.mean(axis=0)
    if not matched:
        pose, fixes = (0.0, pose[1]), (0.0, fixes[1])
    found = [
        Check("NEES of the pose, mean of runs and instants", nees.mean(), *pose),
        Check("NIS of the fixes, mean of runs and instants", nis.mean(), *fixes),
    ]
    if matched:  # each instant's mean over the runs is within with a probability of 95 %
        for what, values, (low, high) in (("NEES", nees, pose), ("NIS", nis, fixes)):
            inside = float(np.mean((values >= low) & (values <= high)))
            found.append(Check(f"{what}: instants whose mean is within", 100.0 * inside, 80.0, math.inf, " %"))
    found.append(Check("heading RMSE", math.degrees(figures.heading_rmse_rad), 0.0, 0.3, " °"))
    return found


def main(runs: int = 100) -> None:
    """Print every figure with its bounds, then both filters side by side."""
    cases: tuple[tuple[str, Callable[[int], Robot], Scenario, bool], ...] = (
        ("matched, white fixes", lambda seed: MatchedRobot(VEHICLE, WHITE, seed), WHITE, True),
        ("matched, slow GNSS error", lambda seed: MatchedRobot(VEHICLE, DEFAULT, seed), DEFAULT, True),
        ("emulated, white fixes", lambda seed: EmulatedRobot(WHITE, seed), WHITE, False),
        ("emulated, default noise", lambda seed: EmulatedRobot(DEFAULT, seed), DEFAULT, False),
        ("emulated, slope of 2 %", lambda seed: EmulatedRobot(SLOPE, seed), SLOPE, False),
    )
    found, rows = [], []
    for name, make, scenario, matched in cases:
        figures = monte_carlo(make, scenario, runs)
        print(f"{name}: {runs} runs of {CHECK_TO / 100:.0f} s")
        for check in checks(figures, runs, matched=matched):
            print(check)
            found.append(check)
        ours = (figures.nees.mean(), figures.position_rmse_m * 1e3, math.degrees(figures.heading_rmse_rad))
        plain = figures.plain_position_rmse_m * 1e3, math.degrees(figures.plain_heading_rmse_rad)
        rows.append((name, *ours, figures.plain_nees.mean(), *plain))
    inside, median, plain_inside, plain_median = outages(lambda seed: EmulatedRobot(DEFAULT, seed), runs)
    print(f"emulated, 30 s without fixes at 1 m/s: {runs} runs")
    found.append(Check("runs within the 3 σ that are reported", 100.0 * inside, 99.0, math.inf, " %"))
    print(found[-1])
    print(f"\n{'':26s}   12 states: NEES, RMSE       |  plain EKF, 3 states: NEES, RMSE")
    for name, *row in rows:
        print("{:26s} {:8.2f} {:6.1f} mm {:6.3f}°  | {:8.1f} {:6.1f} mm {:6.3f}°".format(name, *row))
    ours_m, plain_m = f"{median:6.2f} m", f"{plain_median:6.2f} m"
    print(f"{'30 s without fixes':26s} {inside:8.0%} {ours_m:18s} | {plain_inside:8.0%} {plain_m}")
    print(f"\n{sum(check.holds for check in found)} of {len(found)} hold")
