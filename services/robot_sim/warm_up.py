"""Compiles every kernel of the robot, or loads it from the cache, before sim time begins."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

import numpy as np

from touchline.schemas.curves import Curve
from touchline.schemas.setup import Setup
from touchline.services import onboard
from touchline.services.onboard.interface import STANDSTILL
from touchline.services.robot_sim.accounting.area_raster import AreaRaster
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.paint.ledger import PaintLedger
from touchline.services.robot_sim.paint.projection import POINT_COLUMNS
from touchline.services.robot_sim.paint.smears import smearing
from touchline.services.robot_sim.paint.targets import Target
from touchline.services.robot_sim.paint.track import Track
from touchline.services.robot_sim.sensors.suite import Sensors
from touchline.services.robot_sim.world import body, physics
from touchline.services.robot_sim.world.world import World

_LOOP: Final = "loop"
_STEPS: Final = ("world", "sensors", "paint", "onboard computer", _LOOP)
_LOOP_TICKS: Final = 150
"""Enough to set off."""


def warm_up(
    report: Callable[[str], None] = lambda _line: None,
    setup: Setup | None = None,
) -> None:
    """Run every kernel once on throw-away data; `report` is told what takes long, and nothing if all is cached."""
    setup = setup or Setup()
    begun, compiled_before = time.perf_counter(), _compiled()
    for index, name in enumerate(_STEPS, start=1):
        if _compiled() > compiled_before:  # the first step was not in the cache, and so will the others not be
            report(f"compiling kernels for the first start, {index} of {len(_STEPS)}: {name}")
        _exercise(name, setup)
    if _compiled() > compiled_before:
        report(f"compiled in {time.perf_counter() - begun:.1f} s")


def _compiled() -> int:
    """How often this process has compiled the physics kernel."""
    return sum(physics.advance.stats.cache_misses.values())


def _exercise(name: str, setup: Setup) -> None:
    import shapely

    vehicle, scenario = setup.vehicle, setup.scenario
    if name == _LOOP:
        emulator = Emulator(vehicle, scenario.model_copy(update={"faults": (), "start": None}), setup.onboard)
        emulator.load(onboard.straight(vehicle))
        emulator.start()
        FastRunner(emulator).run(_LOOP_TICKS)
        return
    if name == "onboard computer":
        onboard.warm_up(vehicle, setup.onboard)
        return
    world = World(vehicle, scenario)
    world.step(STANDSTILL, 1)
    if name == "sensors":
        Sensors(vehicle, scenario).read(1, world.state)
    elif name == "paint" and vehicle.tool.paints:
        world.trace[:, body.TRACE_SPRAYING] = 1.0
        world.trace[:, body.TRACE_EAST] = np.linspace(0.0, 0.01, body.STEPS + 1)
        line = Target("line", Curve.from_line((0.0, 0.0), (1.0, 0.0)))
        ledger = PaintLedger([line], vehicle.tool.width_m, vehicle.tool.width_m)
        ledger.record(world.trace)
        ledger.within_by_target_m(ledger.tolerance_m)
        ledger.drawn_by_target_m()
        track = Track()
        track.enter(1, world.pose, ledger.points)
        smearing(ledger, track, vehicle)
    elif name == "paint" and vehicle.tool.covers:
        AreaRaster([shapely.box(0.0, 0.0, 1.0, 1.0)], vehicle.tool.width_m).take(np.zeros((1, POINT_COLUMNS)))
