"""Runs an emulated robot fast to a place on its path, to the tick in which it comes there."""

from __future__ import annotations

from typing import Final

from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import UNLOGGED, FastRunner

_FASTEST_M: Final = 0.02
"""More than a robot comes along its path in a tick."""


def step_towards(runner: FastRunner, emulator: Emulator, arc_length_m: float) -> None:
    """Let some ticks pass, at least one, but none after that in which the robot has come so far along its path [m]."""
    left_m = arc_length_m - emulator.onboard.status.arc_length_m
    runner.step(max(1, int(left_m / _FASTEST_M)), UNLOGGED)


def drive_to(emulator: Emulator, arc_length_m: float) -> None:
    """Let ticks pass until the robot has come so far along its path [m], or its traversal is over."""
    runner = FastRunner(emulator)
    while emulator.active and emulator.onboard.status.arc_length_m < arc_length_m:
        step_towards(runner, emulator, arc_length_m)
