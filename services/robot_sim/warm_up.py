"""Warm-up: compiles every kernel of the robot, or loads it from the cache, before sim time begins."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial

import numpy as np

from touchline import onboard
from touchline.core.compilations import Step, run_steps
from touchline.onboard.interface import standstill
from touchline.onboard.perception.perception import lidars_of
from touchline.onboard.perception.scan import Beams
from touchline.schemas.curves import Curve
from touchline.schemas.errors import CommandRefused
from touchline.schemas.known_ground import OPEN_GROUND
from touchline.schemas.setup import Setup
from touchline.services.robot_sim.accounting.area_raster import AreaRaster
from touchline.services.robot_sim.goal_way.seen_ground import SeenGround
from touchline.services.robot_sim.goal_way.way_ahead import WayAhead
from touchline.services.robot_sim.guided_warm_up import warm_up_guided
from touchline.services.robot_sim.paint.ledger import PaintLedger
from touchline.services.robot_sim.paint.projection import POINT_COLUMNS
from touchline.services.robot_sim.paint.smears import smearing
from touchline.services.robot_sim.paint.targets import Target
from touchline.services.robot_sim.paint.track import Track
from touchline.services.robot_sim.rehearsal import rehearse
from touchline.services.robot_sim.sensors.suite import Sensors
from touchline.services.robot_sim.way_round.unpainted_lines import station_m
from touchline.services.robot_sim.world import body
from touchline.services.robot_sim.world.world import World


def warm_up(
    report: Callable[[str], object] = lambda _line: None, setup: Setup | None = None, *, in_team: bool = False
) -> None:
    """Run every kernel once on throw-away data.

    Args:
        report: Called with the progress, if kernels have to be compiled; not called if all are cached.
        setup: Setup of the robot.
        in_team: True if the robot may be guided by a coordinator.
    """
    setup = setup or Setup()
    steps: list[Step] = [
        ("world", partial(_world, setup)),
        ("sensors", partial(_sensors, setup)),
        ("paint", partial(_paint, setup)),
        ("onboard computer", partial(onboard.warm_up, setup.vehicle, setup.onboard)),
        ("rehearsal", partial(rehearse, setup)),
    ]
    if lidars_of(setup.vehicle):
        steps.append(("ways round", partial(_ways_round, setup)))
    if in_team:
        steps.append(("guided driving", partial(_guided, setup)))
    run_steps(steps, report)


def _world(setup: Setup) -> World:
    world = World(setup.vehicle, setup.scenario)
    world.step(standstill(len(setup.vehicle.drive.actuators)), 1)
    return world


def _sensors(setup: Setup) -> None:
    Sensors(setup.vehicle, setup.scenario).read(1, _world(setup).state)


def _paint(setup: Setup) -> None:
    import shapely

    vehicle, tool, world = setup.vehicle, setup.vehicle.tool, _world(setup)
    if not (tool.paints or tool.covers):
        return
    world.trace[:, body.TRACE_SPRAYING] = 1.0
    world.trace[:, body.TRACE_EAST] = np.linspace(0.0, 0.01, body.STEPS + 1)
    line = Target("line", Curve.from_line((0.0, 0.0), (1.0, 0.0)))
    ledger = PaintLedger([line], tool.width_m, tool.width_m)
    ledger.record(world.trace)
    ledger.within_by_target_m(ledger.tolerance_m)
    ledger.drawn_by_target_m()
    track = Track()
    track.enter(1, world.pose, ledger.points)
    smearing(ledger, track, vehicle)
    if tool.covers:
        AreaRaster([shapely.box(0.0, 0.0, 1.0, 1.0)], tool.width_m).take(np.zeros((1, POINT_COLUMNS)))


def _ways_round(setup: Setup) -> None:
    station_m(Curve.from_line((0.0, 0.0), (1.0, 0.0)), 0.5, 0.0)
    seen, at = SeenGround(OPEN_GROUND), WayAhead.at((0.0, 0.0, 0.0))
    for spec in lidars_of(setup.vehicle):
        beams = Beams.of(spec)
        beams.range_m[:], beams.rays[:] = np.inf, (0.0, 0.0, 1.0, 0.0)
        seen.enter(beams, min(spec.dark_m, spec.max_m), 1)
    at.clearance_m(np.array(setup.vehicle.body.footprint_m), np.ones((1, 2)), 1.0)


def _guided(setup: Setup) -> None:
    with suppress(CommandRefused):  # some robots cannot
        warm_up_guided(setup)
