"""A team of unicycles under a coordinator, without noise: how far apart it stays, and where it ends."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tests.fleet.unicycles import UnicycleLimits, drive
from touchline.services.fleet.coordinator import Coordinator, RobotPose
from touchline.services.fleet.free_area import FreeArea
from touchline.services.fleet.tasks import TeamTask

Floats = NDArray[np.float64]

LIMITS = UnicycleLimits()
PERIOD_S, TICKS = 0.4, 20
TICK_S = PERIOD_S / TICKS


class Driven(NamedTuple):
    """What became of a team: (n, 4) states, the closest two centres ever were (m), and how far each has driven (m)."""

    states: Floats
    closest_m: float
    driven_m: Floats
    time_s: float


def square(side_m: float) -> FreeArea:
    return FreeArea.of([(0.0, 0.0), (side_m, 0.0), (side_m, side_m), (0.0, side_m)])


def names_of(robots: int) -> list[str]:
    return [f"tb{number:02}" for number in range(1, robots + 1)]


def corner_grid(robots: int, apart_m: float = 0.48) -> Floats:
    """(n, 4) robots at rest in a square grid in the corner."""
    across = math.ceil(math.sqrt(robots))
    number = np.arange(robots)
    places = 0.3 + apart_m * np.column_stack((number % across, number // across))
    return np.column_stack((places, np.zeros((robots, 2))))


def on_circle(robots: int, radius_m: float, middle_m: float, seed: int) -> Floats:
    """(n, 4) robots at rest on a circle, a little off their even places, headings anyhow."""
    rng = np.random.default_rng(seed)
    angle = math.tau * (np.arange(robots) + rng.uniform(-0.05, 0.05, robots)) / robots
    places = middle_m + radius_m * np.column_stack((np.cos(angle), np.sin(angle)))
    return np.column_stack((places, rng.uniform(-math.pi, math.pi, robots), np.zeros(robots)))


def poses(states: Floats) -> dict[str, RobotPose]:
    return {name: RobotPose(*row) for name, row in zip(names_of(len(states)), states.tolist(), strict=True)}


def driven(states: Floats, area: FreeArea, task: TeamTask, until_s: float, goals: Floats | None = None) -> Driven:
    """Drive until a time, or until all are within 0.1 m of their goals (n, 2)."""
    coordinator = Coordinator(area, task)
    states, closest, far, time_s = states.copy(), math.inf, np.zeros(len(states)), 0.0
    while time_s < until_s:
        aims = coordinator.update(time_s, poses(states)).values()
        rows = np.array([aim.cell.half_planes for aim in aims])
        before = states[:, :2].copy()
        closest = min(closest, drive(states, rows, np.array([aim.target_m for aim in aims]), LIMITS, TICK_S, TICKS))
        far += np.hypot(*(states[:, :2] - before).T)
        time_s += PERIOD_S
        if goals is not None and np.hypot(*(states[:, :2] - goals).T).max() < 0.1:
            break
    return Driven(states, closest, far, time_s)
