"""Emulated robot with a lidar that is shown hits, and its stops for a thing that appears."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.onboard import Onboard
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.perception.hits import Hits
from touchline.schemas.curves import Curve
from touchline.schemas.messages import Trajectory
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.template import Template
from touchline.schemas.trajectories import assemble, segment, velocity
from touchline.schemas.vehicles import LidarSpec, Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner

Floats = NDArray[np.float64]

SCAN_TICKS = 10
NOTHING: Floats = np.zeros((0, 2))
STANDS_MPS = 0.005


def with_lidar(vehicle: Vehicle) -> Vehicle:
    """Return the vehicle with a lidar that scans all round at once."""
    return vehicle.model_copy(update={"sensors": (LidarSpec(name="lidar", scan_s=0.0),)})


def post(x_m: float, y_m: float, radius_m: float = 0.1) -> Floats:
    """Return points on the outline of a post, (24, 2)."""
    at = np.linspace(0.0, math.tau, 24, endpoint=False)
    return np.column_stack((x_m + radius_m * np.cos(at), y_m + radius_m * np.sin(at)))


class ShownRobot:
    """Emulated robot on a path along x; `things` is what its lidar sees from the next scan on."""

    def __init__(
        self, vehicle: Vehicle, scenario: Scenario, plan: Trajectory, template: Template | None = None
    ) -> None:
        """Load the plan and start."""
        config = OnboardConfig.model_validate({"drive": {"grip": GRIPS.get(scenario.ground.surface, 0.6)}})
        onboard = Onboard(with_lidar(vehicle), config)
        onboard.perception = None  # its hits are given instead
        self.emulator = Emulator(vehicle, scenario, config, onboard)
        self.emulator.load(plan, template or LINE)
        self._runner, self.things = FastRunner(self.emulator), NOTHING
        self.silent = False
        self._phase = 0
        self.emulator.start()

    def run(self, ticks: int) -> None:
        """Let time pass, with a scan at every tenth tick, in nominal ticks where that is possible."""
        last = self.emulator.tick_count + ticks
        while (tick := self.emulator.tick_count) < last:
            if tick % SCAN_TICKS == 0 and not self.silent:
                self.emulator.onboard.protection.take(Hits(self.things, tick, 0.02))
            until = min((tick // SCAN_TICKS + 1) * SCAN_TICKS, last)
            while self.emulator.tick_count < until and self.emulator.active:
                self._runner.step(until - self.emulator.tick_count, np.zeros((0, 0)))
            if not self.emulator.active:
                return

    @property
    def x_m(self) -> float:
        """True place along x."""
        return float(self.emulator.world.state.east_m)

    @property
    def speed_mps(self) -> float:
        """True speed."""
        return float(self.emulator.world.state.speed_mps)


LINE = Template(name="line", segments=[{"id": "s0", "line": {"start": (0.0, 0.0), "end": (1.0, 0.0)}}])
GRIPS = {"grass": 0.6, "wet-grass": 0.35, "clay": 0.45}


def straight(length_m: float, speed_mps: float, acceleration_mps2: float) -> Trajectory:
    """Return a straight path along x from rest to rest, without paint."""
    ramp_m = min(speed_mps**2 / (2.0 * acceleration_mps2), 0.5 * length_m)
    profile = (0.0, 0.0), (ramp_m, speed_mps), (length_m - ramp_m, speed_mps), (length_m, 0.0)
    return assemble([segment("s0", Curve(0.0, 0.0, 0.0, 0.0, length_m), 1)], [], (velocity(s, v) for s, v in profile))


class StopFor(NamedTuple):
    """Stop for a thing that appears.

    Attributes:
        speed_mps: True speed when it appeared.
        way_m: True way from then to rest.
        bound_m: v·(0.11 s + τ) + v² / 2b.
    """

    speed_mps: float
    way_m: float
    bound_m: float


def stop_for(vehicle: Vehicle, surface: str, speed_mps: float, phase: int) -> StopFor:
    """Let a thing appear close ahead of an emulated robot, and return how it stopped.

    Args:
        vehicle: The robot.
        surface: Its ground.
        speed_mps: Its speed.
        phase: Ticks from a scan to the appearance.
    """
    acceleration = vehicle.drive.max_acceleration_mps2
    run_up_m = speed_mps**2 / (2.0 * acceleration)
    plan = straight(2.0 * run_up_m + 8.0, speed_mps, acceleration)
    scenario = Scenario.model_validate({"ground": {"surface": surface}, "seed": 3})
    robot = ShownRobot(vehicle, scenario, plan)
    while robot.x_m < run_up_m + 2.0:
        robot.run(1)
    robot.run(SCAN_TICKS - robot.emulator.tick_count % SCAN_TICKS + phase)
    before_m, before_mps = robot.x_m, robot.speed_mps
    reach_m = max(x for x, _ in vehicle.body.footprint_m)
    robot.things = post(before_m + reach_m + 0.4, 0.0)
    robot.run(3)
    while robot.speed_mps > STANDS_MPS:
        robot.run(1)
    b = robot.emulator.onboard.protection.braking_mps2
    bound_m = before_mps * (0.11 + drive_of(vehicle).lag_s) + before_mps**2 / (2.0 * b)
    return StopFor(before_mps, robot.x_m - before_m, bound_m)
