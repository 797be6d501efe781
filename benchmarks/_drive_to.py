"""Fast drive of an emulated robot to a place on its path, exact to the tick."""

from __future__ import annotations

from typing import Final

from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import UNLOGGED, FastRunner

_FASTEST_M: Final = 0.02
"""Upper bound of a robot's progress along its path in a tick."""


def step_towards(runner: FastRunner, emulator: Emulator, arc_length_m: float) -> None:
    """Run ticks, at least one, up to the one in which the robot reaches an arc length of its path [m]."""
    left_m = arc_length_m - emulator.onboard.status.arc_length_m
    runner.step(max(1, int(left_m / _FASTEST_M)), UNLOGGED)


def drive_to(emulator: Emulator, arc_length_m: float) -> None:
    """Run ticks until the robot reaches an arc length of its path [m], or its traversal is over."""
    runner = FastRunner(emulator)
    while emulator.active and emulator.onboard.status.arc_length_m < arc_length_m:
        step_towards(runner, emulator, arc_length_m)
