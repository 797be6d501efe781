"""A rig driven open loop with an estimator that watches."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from benchmarks._data_sheets import data_sheets
from tests.onboard.rig import Rig
from tests.two_wheels import STANDSTILL
from touchline.onboard.estimation.filter import Estimator
from touchline.onboard.interface import Command, SensorFrame
from touchline.schemas.scenario import Scenario


def wander(tick: int) -> Command:
    """Stand, then drive with gentle turns both ways."""
    if tick < 80:
        return STANDSTILL
    turn = 2.0 * math.sin(tick / 250.0)
    return Command((9.0 - turn, 9.0 + turn), False, False)


def drive(
    rig: Rig,
    estimator: Estimator,
    ticks: int,
    command: Callable[[int], Command] = wander,
    change: Callable[[SensorFrame], SensorFrame] = lambda frame: frame,
) -> None:
    for tick in range(ticks):
        estimator.step(change(rig.step(command(tick))))


def under_way(seed: int, ticks: int, scenario: Scenario | None = None) -> tuple[Rig, Estimator]:
    """One that has wandered for so long."""
    rig = Rig(scenario=scenario or Scenario(), seed=seed)
    estimator = Estimator(rig.vehicle, data_sheets(rig.scenario))
    drive(rig, estimator, ticks)
    return rig, estimator


def until_fix(rig: Rig, estimator: Estimator, command: Command) -> SensorFrame:
    """Go on until a fix has arrived; its frame is yet to be given to the estimator."""
    frame = rig.step(command)
    while not frame.gnss:
        estimator.step(frame)
        frame = rig.step(command)
    return frame


def error(rig: Rig, estimator: Estimator) -> np.ndarray:
    x = estimator.state
    return np.array([x[0] - rig.x, x[1] - rig.y, math.remainder(x[2] - rig.heading, math.tau)])
