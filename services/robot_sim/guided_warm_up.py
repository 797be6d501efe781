"""Warm-up of guided driving: compiles or loads its kernels in a thread, while the robot's loop turns."""

from __future__ import annotations

import threading
from typing import Final

import numpy as np

from touchline.schemas.messages import Guidance
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.setup import Setup
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.telemetry import Telemetry

_ALIGNED_TICKS: Final = 1000
"""More ticks than a robot with a usual receiver or camera needs to find its place."""
_DRIVEN_TICKS: Final = 20


_one_at_a_time = threading.Lock()
_done: list[tuple[Vehicle, OnboardConfig]] = []


def warm_up_guided(setup: Setup) -> None:
    """Let a throw-away robot find its place, and drive a moment; once in a process for robots of one kind.

    Args:
        setup: Setup of the robot; faults are left out.

    Raises:
        CommandRefused: Such a robot cannot be guided.
    """
    kind = setup.vehicle, setup.onboard
    with _one_at_a_time:
        if kind not in _done:
            _drive_a_moment(setup)
            _done.append(kind)


def _drive_a_moment(setup: Setup) -> None:
    world = setup.scenario.model_copy(update={"faults": (), "start": setup.scenario.standing()})
    emulator = Emulator(setup.vehicle, world, setup.onboard)
    emulator.begin_guided()
    runner, telemetry = FastRunner(emulator), Telemetry(emulator)
    telemetry.begin([])
    while (whereabouts := emulator.onboard.whereabouts) is not None and not whereabouts.aligned:
        if emulator.tick_count > _ALIGNED_TICKS:
            return
        emulator.tick()
        telemetry.after_tick()
    if whereabouts is not None:
        far = np.array([(1.0, 0.0, whereabouts.x_m + 1.0)])
        guidance = Guidance(number=1, echo_s=whereabouts.stamp_s, target_x_m=whereabouts.x_m, half_planes=far.ravel())
        emulator.onboard.take_guidance(guidance)
    emulator.tick()  # as when a tick is not nominal
    telemetry.after_tick()
    runner.run(_DRIVEN_TICKS)
