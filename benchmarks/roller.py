"""Consistency of the estimator on the clay roller: NEES, steering offset, an outage on a lane, a minute at rest.

`python -m benchmarks roller`; `runs` are made of each case.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from benchmarks._settings import Small
from benchmarks.estimator import Check, EmulatedRobot, error
from touchline.onboard import filter_model as m
from touchline.onboard.estimation.filter import Estimator
from touchline.onboard.interface import SensorFrame
from touchline.schemas.onboard import DriveSheet, GnssSheet, ImuSheet, OnboardConfig
from touchline.schemas.scenario import Ground, Scenario
from touchline.schemas.vehicles.shipped import CLAY_ROLLER as VEHICLE

CLAY = Scenario(ground=Ground(surface="clay"))
ONBOARD = OnboardConfig(
    drive=DriveSheet(slip_relative=0.03, crab_rad=0.0, side_slip_m_rtm=0.001),
    gnss=GnssSheet(antenna_sigma_m=0.0, stamp_offset_sigma_s=0.0),
    imu=ImuSheet(gyro_scale_sigma=0.0),
)
"""The computer of a robot for clay, on which wheels slip half as much again as on grass."""
STAND_TICKS = 90
CHECK_FROM, CHECK_TO, CHECK_EVERY = 2000, 6000, 200
OUTAGE_FROM, OUTAGE_TICKS = 4000, 3000
REST_FROM, REST_TICKS = 3000, 6000
SMALL = Small(
    {"runs": 1},
    (
        "clay roller, default noise: # runs",
        "NEES, lane: mean of runs and instants # # to #",
        "steering offset after a minute: RMS error # ° at most #",
        "runs that know it to 0.15° # % at least #",
        "30 s without fixes: runs within 3 σ # % at least #",
        "a minute at rest: NEES # at most #",
    ),
)


class EmulatedRoller(EmulatedRobot):
    """An emulated roller, drum and steering commanded open loop."""

    @property
    def steering_rad(self) -> float:
        """True angle of its wheel to the left of the encoder's."""
        return float(self.world.figures.drive.offset_rad)

    def step(self, speed: float, steering_rad: float) -> SensorFrame:
        return self.command(speed / VEHICLE.drive.drum_radius_m, steering_rad)


Course = Callable[[int], tuple[float, float]]


def speed_mps(tick: int) -> float:
    """Speed at a tick: at rest, then accelerating as plans do, to 0.95 m/s."""
    return min(max(tick - STAND_TICKS, 0) * 0.001, 0.95)


def wander(tick: int) -> tuple[float, float]:
    """Bends to both sides, up to 0.45 rad."""
    return speed_mps(tick), 0.45 * math.sin(0.4 * (tick - STAND_TICKS) / 100) if tick > STAND_TICKS else 0.0


def lane(tick: int) -> tuple[float, float]:
    """Straight on, but for the little that steering does all the time."""
    return speed_mps(tick), 0.02 * math.sin(0.9 * tick / 100)


def stop(tick: int) -> tuple[float, float]:
    """A lane that ends at rest, with the steering turned there."""
    left = max(REST_FROM - 1000 - tick, 0) * 0.001
    return min(speed_mps(tick), left), 0.3 if tick > REST_FROM else lane(tick)[1]


class Run(NamedTuple):
    """A roller and its estimator at the end of a course."""

    roller: EmulatedRoller
    estimator: Estimator

    @property
    def nees(self) -> float:
        """NEES of position and heading; 3 expected."""
        e = error(self.roller.pose, self.estimator.state)
        return float(e @ np.linalg.solve(self.estimator.pose_covariance, e))

    @property
    def offset_error_rad(self) -> float:
        """Error of the estimated steering offset."""
        return float(self.estimator.state[m.ODOMETRY_ERROR + 1]) - self.roller.steering_rad


def drive(course: Course, ticks: int, seed: int, silent_from: int | None = None, scenario: Scenario = CLAY) -> Run:
    """A new roller along a course."""
    run = Run(EmulatedRoller(scenario, seed, VEHICLE), Estimator(VEHICLE, ONBOARD))
    go_on(run, course, 1, ticks, silent_from)
    return run


def go_on(run: Run, course: Course, first: int, last: int, silent_from: int | None = None) -> None:
    """Along a course for more ticks."""
    for tick in range(first, last + 1):
        run.roller.silent = silent_from is not None and tick > silent_from
        run.estimator.step(run.roller.step(*course(tick)))


def nees_of(course: Course, seed: int) -> list[float]:
    """Every other second, from when the roller drives at speed."""
    run = drive(course, CHECK_FROM - 1, seed)
    found = []
    for tick in range(CHECK_FROM, CHECK_TO + 1, CHECK_EVERY):
        go_on(run, course, tick, tick)
        found.append(run.nees)
        go_on(run, course, tick + 1, tick + CHECK_EVERY - 1)
    return found


def main(runs: int = 100) -> None:
    """Print every figure with its bounds."""
    seeds = range(1, runs + 1)
    found = []
    for name, course in (("lane", lane), ("bends", wander)):
        nees = np.array([nees_of(course, seed) for seed in seeds])
        found.append(Check(f"NEES, {name}: mean of runs and instants", float(nees.mean()), 2.5, 3.5))
    offsets = np.array([drive(lane, 6000, seed).offset_error_rad for seed in seeds])
    within = 100.0 * float(np.mean(np.abs(offsets) < math.radians(0.15)))
    rms_deg = math.degrees(float(np.sqrt(np.mean(offsets**2))))
    found.append(Check("steering offset after a minute: RMS error", rms_deg, 0.0, 0.15, " °"))
    found.append(Check("runs that know it to 0.15°", within, 68.0, math.inf, " %"))
    outages = [drive(lane, OUTAGE_FROM + OUTAGE_TICKS, seed, OUTAGE_FROM) for seed in seeds]
    bound = float(chdtri(3, 1.0 - 0.9973))
    inside = 100.0 * float(np.mean([run.nees <= bound for run in outages]))
    found.append(Check("30 s without fixes: runs within 3 σ", inside, 99.0, math.inf, " %"))
    found.append(Check("the same: NEES", float(np.mean([run.nees for run in outages])), 0.0, 3.5))
    rests = [drive(stop, REST_FROM + REST_TICKS, seed) for seed in seeds]
    found.append(Check("a minute at rest: NEES", float(np.mean([run.nees for run in rests])), 0.0, 3.5))
    print(f"clay roller, default noise: {runs} runs")
    print(*found, sep="\n")
