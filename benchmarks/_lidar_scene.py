"""A scene of walls, posts and walking people, and the scans that a lidar makes of it: independent of the emulator."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.onboard.estimation.filter import Estimator
from touchline.onboard.filter_model import EAST, HEADING, NORTH, RING, SPEED, YAW_RATE
from touchline.onboard.interface import TICK_S, TICKS_PER_S, AuxiliarySample
from touchline.onboard.perception.perception import Perception
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.lidar_spec import LidarSpec

Floats = NDArray[np.float64]
Pose = tuple[float, float, float]
LEG_M = 0.07
"""Radius of a leg."""


class Scene(NamedTuple):
    """Shapes at a time: (n, 3) circles x, y, radius, and (m, 4) walls from x, y to x, y, map frame [m]."""

    circles: Floats = np.empty((0, 3))
    walls: Floats = np.empty((0, 4))


def box(x: float, y: float, length_m: float, width_m: float) -> Floats:
    """Return the walls of a box with its lower left corner there."""
    a, b, c, d = (x, y), (x + length_m, y), (x + length_m, y + width_m), (x, y + width_m)
    return np.array([(*p, *q) for p, q in ((a, b), (b, c), (c, d), (d, a))])


def legs(x: float, y: float, heading_rad: float, phase_rad: float) -> Floats:
    """Return the circles of a person's legs, which swing by 0.26 m, 0.2 m apart across."""
    ahead = np.array([math.cos(heading_rad), math.sin(heading_rad)])
    left = np.array([-ahead[1], ahead[0]])
    swing = 0.26 * math.sin(phase_rad) * ahead + 0.1 * left
    return np.array([(x + swing[0], y + swing[1], LEG_M), (x - swing[0], y - swing[1], LEG_M)])


def cast(origins: Floats, directions: Floats, scene: Scene) -> Floats:
    """Return the distance along each ray to the nearest shape, inf without any.

    Args:
        origins: (n, 2).
        directions: (n, 2) unit vectors.
        scene: The shapes.
    """
    found = np.full(len(origins), np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        for x, y, radius in scene.circles:
            to = np.array([x, y]) - origins
            along = (to * directions).sum(1)
            half = radius**2 - (to**2).sum(1) + along**2
            near = along - np.sqrt(np.where(half >= 0.0, half, np.nan))
            found = np.where(near > 0.0, np.fmin(found, near), found)
        for x0, y0, x1, y1 in scene.walls:
            wall, to = np.array([x1 - x0, y1 - y0]), np.array([x0, y0]) - origins
            cross = directions[:, 0] * wall[1] - directions[:, 1] * wall[0]
            along = (to[:, 0] * wall[1] - to[:, 1] * wall[0]) / cross
            share = (to[:, 0] * directions[:, 1] - to[:, 1] * directions[:, 0]) / cross
            found = np.where((along > 0.0) & (share >= 0.0) & (share <= 1.0), np.fmin(found, along), found)
    return found


class Seeing:
    """A robot that drives as it is told and scans a scene: its estimator is given the true pose, with errors.

    Args:
        vehicle: Robot with one lidar.
        pose_at: True pose (x, y, heading) at a time.
        scene_at: The scene at a time.
        seed: Seed of all errors.
    """

    dropout = 0.0
    """Share of beams without a return for no reason."""
    rain = 0.0
    """Share of beams with a return from nothing, between 0.3 and 2 m or at the farthest."""
    rain_m = 2.0
    pose_sigma = (0.0, 0.0)
    """σ of the estimator's place along an axis [m] and heading [rad], new for each scan."""

    def __init__(
        self, vehicle: Vehicle, pose_at: Callable[[float], Pose], scene_at: Callable[[float], Scene], seed: int = 1
    ) -> None:
        self._pose_at, self._scene_at, self._rng = pose_at, scene_at, np.random.default_rng(seed)
        (lidar,) = vehicle.sensors
        assert isinstance(lidar, LidarSpec)
        self.lidar, self.estimator, self.perception = lidar, Estimator(vehicle, OnboardConfig()), Perception(vehicle)
        self.estimator.times.first_tick, self.scans = 1, 0

    @property
    def time_s(self) -> float:
        """Time of the last scan."""
        return self.estimator.times.tick * TICK_S

    def _believe(self, tick: int) -> None:
        """Fill the estimator's ring up to a tick."""
        east, north, turn = self._rng.normal(0.0, 1.0, 3) * (self.pose_sigma[0], self.pose_sigma[0], self.pose_sigma[1])
        self.estimator.times.tick = tick
        for k in range(max(tick - RING + 1, 0), tick + 1):
            x, y, heading = self._pose_at(k * TICK_S)
            before = self._pose_at((k - 1) * TICK_S)
            state = self.estimator.ring.states[k % RING]
            state[[EAST, NORTH, HEADING]] = x + east, y + north, heading + turn
            state[SPEED] = math.hypot(x - before[0], y - before[1]) * TICKS_PER_S
            state[YAW_RATE] = (heading - before[2]) * TICKS_PER_S
            variances = np.zeros(len(state))
            variances[[EAST, NORTH]], variances[HEADING] = self.pose_sigma[0] ** 2, self.pose_sigma[1] ** 2
            self.estimator.ring.covariances[k % RING] = np.diag(variances)

    def scan(self) -> list[int]:
        """Make the next scan and let perception take it; return what it returns."""
        return self.perception.take(self.sample(), self.estimator)

    def sample(self) -> AuxiliarySample:
        """Make the next scan."""
        lidar, rng = self.lidar, self._rng
        self.scans += 1
        tick = self.scans * TICKS_PER_S // lidar.rate_hz + RING
        self._believe(tick)
        times = tick * TICK_S - lidar.scan_s * (1.0 - np.arange(lidar.beams) / (lidar.beams - 1))
        ranges = np.full(lidar.beams, np.inf)
        for part in np.array_split(np.arange(lidar.beams), 10):  # the scene moves in tenths of a scan, the robot always
            scene = self._scene_at(float(times[part].mean()))
            poses = np.array([self._pose_at(float(time)) for time in times[part]])
            angles = poses[:, 2] + lidar.first_rad + part * lidar.step_rad
            mount = np.array([(math.cos(h), math.sin(h)) for h in poses[:, 2]])
            origins = poses[:, :2] + lidar.x_m * mount + lidar.y_m * np.stack((-mount[:, 1], mount[:, 0]), 1)
            ranges[part] = cast(origins, np.stack((np.cos(angles), np.sin(angles)), 1), scene)
        ranges += rng.normal(0.0, 1.0, lidar.beams) * (lidar.sigma_m + lidar.sigma_relative * np.minimum(ranges, 1e3))
        ranges[(ranges > lidar.dark_m) | (rng.random(lidar.beams) < self.dropout)] = np.inf
        drops = rng.random(lidar.beams) < self.rain
        ranges[drops] = np.minimum(ranges[drops], rng.uniform(0.3, self.rain_m, int(drops.sum())))
        return AuxiliarySample(lidar.name, tick * TICK_S, tuple(ranges.tolist()))


def standing(x: float = 0.0, y: float = 0.0, heading_rad: float = 0.0) -> Callable[[float], Pose]:
    """Return the pose over time of a robot that stands."""
    return lambda _time_s: (x, y, heading_rad)


def still(circles: Sequence[Sequence[float]] = (), walls: Floats | None = None) -> Callable[[float], Scene]:
    """Return the scene over time of things that stand."""
    scene = Scene(np.array(circles, float).reshape(-1, 3), np.empty((0, 4)) if walls is None else walls)
    return lambda _time_s: scene
