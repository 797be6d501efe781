"""Warm-up: compiles (or loads from the cache) every kernel before the first real tick."""

from __future__ import annotations

import numpy as np

from touchline.core.physical_constants import GRAVITY_MPS2
from touchline.onboard.computer import Onboard
from touchline.onboard.control.pure_pursuit import PurePursuitFollower
from touchline.onboard.drives import onboard_drive
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.executive.handover import PlanPlace, taken_over_at
from touchline.onboard.executive.localization_monitor import speaks_against_painting
from touchline.onboard.interface import TICKS_PER_S, AuxiliarySample, GnssSample, ImuSample, MagSample, SensorFrame
from touchline.onboard.perception.hits import NO_POINTS, Hits
from touchline.onboard.perception.perception import lidars_of
from touchline.onboard.protection.clearance import clearance
from touchline.onboard.protection.way import lay_straight, lay_turn
from touchline.onboard.tracking_state import COMMAND
from touchline.onboard.trajectory.path_projection import AHEAD_COLUMNS
from touchline.schemas.curves import Curve
from touchline.schemas.messages import Actuation, Trajectory
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.trajectories import assemble, segment, velocity
from touchline.schemas.vehicles import Vehicle

_TICKS = 90
_OBSTACLE = ((3.0, 0.0), (4.0, 0.0), (4.0, 1.0))


def warm_up(vehicle: Vehicle | None = None, config: OnboardConfig | None = None) -> None:
    """Run all kernels once in a throw-away robot's first ticks: seconds if nothing is cached, else milliseconds.

    Args:
        vehicle: Nominal robot; None: the default one.
        config: Configuration of its computer; None: the default one.
    """
    vehicle = vehicle or Vehicle()
    onboard = Onboard(vehicle, config or OnboardConfig())
    course = onboard.prepare(straight(vehicle), obstacles=[_OBSTACLE])
    taken_over_at(PlanPlace(course.plan, 0, 0.0), course.plan)  # as under way, where nothing may be compiled
    course.fence.beyond_m(0.0, 0.0, 0.0)  # as where a template has a boundary
    onboard.take(course)
    onboard.start()
    encoders = (0.0,) * len(vehicle.drive.actuators)
    for tick in range(1, _TICKS):
        fix = GnssSample((tick - 11) / TICKS_PER_S, 0.0, 0.0, 1e-4, 3, 20, 0.0)
        fixes = (fix,) if tick % 10 == 1 and tick > 11 else ()
        onboard.protection.take(Hits(NO_POINTS, tick, 0.0))
        imu, mag = ImuSample(0.0, 0.0, 0.0, 0.0, 0.0, GRAVITY_MPS2), MagSample(0.0, 1.7e-5, -4.8e-5)
        onboard.step(SensorFrame(tick, tick / TICKS_PER_S, imu, mag, encoders, fixes))
        scans = [AuxiliarySample(each.name, tick / TICKS_PER_S, (3.0,) * each.beams) for each in lidars_of(vehicle)]
        if tick % 10 == 0:
            onboard.take_samples(scans)
    speaks_against_painting(onboard.computer, 0.0)
    _warm_up_rare(vehicle)
    if onboard.protection.on:
        lay_turn(onboard.computer, 1.0)
        lay_straight(onboard.computer)
        body = np.array(vehicle.body.footprint_m, dtype=np.float64)
        clearance(body, 1.0, (0.0, 0.0, 0.0), np.zeros((1, 2)), 1.0)


def _warm_up_rare(vehicle: Vehicle) -> None:
    """Run the kernels that a robot on its path never needs: the fallback of followers, and braking off course."""
    drive, pursuit = drive_of(vehicle), PurePursuitFollower(vehicle)
    count = len(vehicle.drive.actuators)
    now, actuators = np.zeros(COMMAND + count), np.zeros(count)
    pursuit.step(now, np.zeros((pursuit.fine_rows, AHEAD_COLUMNS)))
    onboard_drive.command(drive.figures, 0.0, 0.0, now, actuators)
    onboard_drive.actuators_of(drive.figures, 0.0, 0.0, now)
    onboard_drive.twist(drive.figures, actuators, now)


def straight(vehicle: Vehicle) -> Trajectory:
    """Make a trajectory of a metre straight ahead at a speed within the vehicle's limits, without spraying."""
    line = segment("w", Curve(0.0, 0.0, 0.0, 0.0, 1.0))
    return assemble([line], [(0.0, Actuation.NONE)], [velocity(0.0, min(0.5, vehicle.drive.transit_speed_mps))])
