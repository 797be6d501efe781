"""Consistency of the estimate of the small robots, with the overhead camera and with odometry only.

`python -m benchmarks positioning`; `runs` are made of each robot.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from benchmarks._settings import Small
from benchmarks.estimator import Check, error
from touchline.onboard.estimation.filter import Estimator
from touchline.onboard.interface import TICK_S, TICKS_PER_S, Command
from touchline.schemas.faults import CameraOutage
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import ODOMETRY, Vehicle
from touchline.schemas.vehicles.shipped import SHIPPED, on_its_ground, with_its_own
from touchline.services.robot_sim.fault_timeline import FaultTimeline
from touchline.services.robot_sim.sensors.suite import Sensors
from touchline.services.robot_sim.world.world import TruePose, World

NAMES = ("turtlebot3-waffle-pi", "turtlebot2")
STAND_TICKS = 60
SETTLED_TICKS, CHECK_EVERY = 1000, 50
OUTAGE_S, OUTAGE_FROM_S = 5.0, 20.0
LAST_S = 30.0
DISTANCE_M = 20.0
OUTSIDE_3_SIGMA = 0.0027
Pose = tuple[float, float, float]
ORIGIN: Pose = (0.0, 0.0, 0.0)
SMALL = Small(
    {"runs": 1},
    (
        *(f"{name}: # runs; the camera's NIS of # poses or headings was beyond the gates" for name in NAMES),
        "camera: NEES of the pose # at most #",
        "camera: position RMSE # mm at most #",
        "5 s without it: median error # mm at most #",
        "odometry, 20 m: median larger σ # mm at most #",
        "# of # hold",
    ),
)


class OpenLoopRobot:
    """World and sensors of the emulator; the wheels are commanded along a gentle curve, beside the estimator."""

    def __init__(self, vehicle: Vehicle, scenario: Scenario, config: OnboardConfig, start: Pose = ORIGIN) -> None:
        self.world, self.sensors = World(vehicle, scenario), Sensors(vehicle, scenario)
        self.faults, self.estimator = FaultTimeline(scenario.faults, vehicle.drive), Estimator(vehicle, config)
        self.world.place(TruePose(*start))
        self.estimator.restart(ORIGIN)
        self._drive, self._tick = vehicle.drive, 0

    def step(self) -> None:
        """Run a tick: the robot stands, speeds up, then wavers to both sides."""
        self._tick += 1
        since_s = max(self._tick - STAND_TICKS, 0) * TICK_S
        fastest = 0.9 * self._drive.transit_speed_mps
        speed = min(since_s * self._drive.max_acceleration_mps2, fastest)
        rim = self._drive.half_track_m * 0.4 * speed * math.sin(0.2 * since_s)
        radius = self._drive.wheel_radius_m
        self.faults.step(self._tick)
        command = Command(((speed - rim) / radius, (speed + rim) / radius), False, False)
        self.world.step(command, self._tick, self.faults.effects)
        self.estimator.step(self.sensors.read(self._tick, self.world.state, self.faults.effects))

    @property
    def error(self) -> NDArray[np.float64]:
        """Error of the estimate: east, north [m], heading [rad]."""
        return error(self.world.pose, self.estimator.state)

    @property
    def nees(self) -> float:
        """NEES of the pose; 3 expected."""
        return float(self.error @ np.linalg.solve(self.estimator.pose_covariance, self.error))

    @property
    def within_3_sigma(self) -> bool:
        """True if the position is within 3 σ."""
        e, p = self.error[:2], self.estimator.pose_covariance[:2, :2]
        return bool(e @ np.linalg.solve(p, e) <= chdtri(2, OUTSIDE_3_SIGMA))


def settings(name: str, seed: int, *, outage: bool = False) -> tuple[Vehicle, Scenario, OnboardConfig]:
    """Create a shipped robot on its ground, with matching data sheets."""
    fault = CameraOutage(kind="camera-outage", start_s=OUTAGE_FROM_S, duration_s=OUTAGE_S)
    scenario = Scenario(seed=seed, faults=(fault,) if outage else ())
    return SHIPPED[name].vehicle, on_its_ground(name, scenario), with_its_own(name, OnboardConfig())


class Seen(NamedTuple):
    """Figures of runs with the camera.

    Attributes:
        nees: (runs, checks) NEES of the pose.
        nis: Mean NIS of the positions over each run, as weighted.
        heading_nis: Mean NIS of the headings.
        rejected: Number of rejected poses and headings.
        errors: (runs, checks, 3) errors of the pose.
        blind_nees: (runs,) NEES at the end of the outage.
        blind_inside: (runs,) whether the position is within 3 σ there.
        blind_m: (runs,) position error there.
    """

    nees: NDArray[np.float64]
    nis: NDArray[np.float64]
    heading_nis: NDArray[np.float64]
    rejected: int
    errors: NDArray[np.float64]
    blind_nees: NDArray[np.float64]
    blind_inside: NDArray[np.bool_]
    blind_m: NDArray[np.float64]


def seen(name: str, seeds: range) -> Seen:
    """Run 30 s, for 5 s of which the camera finds nothing."""
    nees, nis, heading_nis, blind, rejected = list[list[float]](), [], [], [], 0
    errors: list[list[NDArray[np.float64]]] = []
    last_blind = round((OUTAGE_FROM_S + OUTAGE_S) * TICKS_PER_S)
    for seed in seeds:
        robot = OpenLoopRobot(*settings(name, seed, outage=True))
        nees.append([])
        errors.append([])
        for tick in range(1, round(LAST_S * TICKS_PER_S) + 1):
            robot.step()
            if tick >= SETTLED_TICKS and tick % CHECK_EVERY == 0:
                nees[-1].append(robot.nees)
                errors[-1].append(robot.error)
            if tick == last_blind:
                blind.append((robot.nees, robot.within_3_sigma, math.hypot(*robot.error[:2])))
        n = robot.estimator.counters
        nis.append(n.fix_nis_sum / n.fixes)
        heading_nis.append(n.heading_nis_sum / n.headings)
        rejected += n.fixes_rejected + n.headings_rejected
    blind_nees, inside, blind_m = (np.array(column) for column in zip(*blind, strict=True))
    return Seen(
        np.array(nees), np.array(nis), np.array(heading_nis), rejected, np.array(errors), blind_nees, inside, blind_m
    )


class Alone(NamedTuple):
    """Figures of runs with odometry only, at the end of the path; (runs,) each."""

    nees: NDArray[np.float64]
    inside: NDArray[np.bool_]
    off_m: NDArray[np.float64]
    sigma_m: NDArray[np.float64]


def alone(name: str, seeds: range) -> Alone:
    """Run 20 m from a start that is known to the data sheet's accuracy."""
    rows = []
    for seed in seeds:
        vehicle, scenario, config = settings(name, seed)
        rng, sheet = np.random.default_rng(seed), config.odometry
        east, north = rng.normal(0.0, sheet.start_sigma_m, 2).tolist()
        start = east, north, float(rng.normal(0.0, sheet.start_sigma_rad))
        robot = OpenLoopRobot(vehicle.model_copy(update={"positioning": ODOMETRY}), scenario, config, start)
        way_m = 0.0
        while way_m < DISTANCE_M:
            robot.step()
            way_m += robot.world.state.speed_mps * TICK_S
        sigma = robot.estimator.position_sigma_m
        rows.append((robot.nees, robot.within_3_sigma, math.hypot(*robot.error[:2]), sigma))
    return Alone(*(np.array(column) for column in zip(*rows, strict=True)))


def _most(degrees: int, runs: int) -> float:
    """97.5 % bound of the mean over `runs` of a χ² with `degrees` of freedom."""
    return float(chdtri(degrees * runs, 0.025)) / runs


def main(runs: int = 100) -> None:
    """Print every figure with its bounds: a filter may be cautious, but not over-confident."""
    found: list[Check] = []
    for name in NAMES:
        by_camera, by_wheels = seen(name, range(1, runs + 1)), alone(name, range(1, runs + 1))
        rmse = np.sqrt((by_camera.errors**2).mean(axis=(0, 1)))
        checks = (
            Check("camera: NEES of the pose", by_camera.nees.mean(), 0.0, _most(3, runs)),
            Check("camera: NIS of positions, as weighed", by_camera.nis.mean(), 1.9, 2.3),
            Check("camera: NIS of headings", by_camera.heading_nis.mean(), 0.9, 1.1),
            Check("camera: position RMSE", 1e3 * math.hypot(*rmse[:2]), 0.0, 7.0, " mm"),
            Check("camera: heading RMSE", math.degrees(rmse[2]), 0.0, 0.3, " °"),
            Check("5 s without it: NEES", by_camera.blind_nees.mean(), 0.0, _most(3, runs)),
            Check("5 s without it: position within 3 σ", 100.0 * by_camera.blind_inside.mean(), 99.0, 100.0, " %"),
            Check("5 s without it: median error", 1e3 * np.median(by_camera.blind_m), 0.0, 20.0, " mm"),
            Check("odometry, 20 m: position within 3 σ", 100.0 * by_wheels.inside.mean(), 99.0, 100.0, " %"),
            Check("odometry, 20 m: NEES of the pose", by_wheels.nees.mean(), 0.0, _most(3, runs)),
            Check("odometry, 20 m: median error", 1e3 * np.median(by_wheels.off_m), 0.0, 1000.0, " mm"),
            Check("odometry, 20 m: median larger σ", 1e3 * np.median(by_wheels.sigma_m), 0.0, 1000.0, " mm"),
        )
        print(f"{name}: {runs} runs; the camera's NIS of {by_camera.rejected} poses or headings was beyond the gates")
        for check in checks:
            print(check)
        found += checks
    print(f"\n{sum(check.holds for check in found)} of {len(found)} hold")
