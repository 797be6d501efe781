"""Path of a trajectory for the traffic rules: the body's place over time, and where it may wait."""

import math
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.traffic.conflicts import STEP_M, STOP_S, TimedPath
from touchline.onboard.executive.mission import RESUMED_RUN_UP_M
from touchline.onboard.trajectory.path import poses_along
from touchline.onboard.trajectory.trajectory import LoadedTrajectory
from touchline.schemas.messages import Actuation
from touchline.schemas.vehicles import Vehicle

Floats = NDArray[np.float64]

HOLD_EVERY_M: Final = 1.0
"""Spacing of waiting places on a transition between two swaths."""
COVER_HOLD_EVERY_M: Final = 2.0
"""Spacing of waiting places for a tool that covers."""
SETTLE_S: Final = 0.5
"""Least time at planned speed between a wait and paint."""
REPORT_LAG_M: Final = 0.5
"""Allowance for a robot's progress since its last report, and for its position error."""
SPIN_STEP_RAD: Final = 0.25


def timed_path(plan: LoadedTrajectory, vehicle: Vehicle) -> TimedPath:
    """Convert a loaded trajectory to a path for the traffic rules.

    A painting robot may drive back from its resting place to before where its paint stopped, as far as a restarted
    process does; a covering one continues where it stands.

    Args:
        plan: The loaded trajectory.
        vehicle: Vehicle that drives it.
    """
    arc_m, poses = _poses(plan)
    middle, radius_m = body_disc(vehicle)
    cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x = poses[:, 0] + cos * middle[0] - sin * middle[1]
    y = poses[:, 1] + sin * middle[0] + cos * middle[1]
    stop_s = vehicle.tool.work_speed_mps / vehicle.drive.max_acceleration_mps2 if vehicle.tool.covers else STOP_S
    brakes_m = float(plan.speeds[:, 1].max()) ** 2 / (2.0 * vehicle.drive.max_acceleration_mps2)
    return TimedPath(
        arc_m,
        np.column_stack((x, y)),
        times_s(plan, arc_m),
        radius_m,
        _holds(plan, vehicle),
        brakes_m + REPORT_LAG_M,
        REPORT_LAG_M if vehicle.tool.covers else brakes_m + RESUMED_RUN_UP_M,
        stop_s,
    )


def body_disc(vehicle: Vehicle) -> tuple[tuple[float, float], float]:
    """Return the smallest disc that holds the body: its middle in the body's frame (m), and its radius (m)."""
    import shapely

    corners = shapely.MultiPoint(vehicle.body.footprint_m)
    middle = shapely.minimum_bounding_circle(corners).centroid
    return (middle.x, middle.y), max(math.dist(corner, (middle.x, middle.y)) for corner in vehicle.body.footprint_m)


def times_s(plan: LoadedTrajectory, arc_m: Floats) -> Floats:
    """Return the planned times (s) at arc lengths, after turns on the spot there.

    Args:
        plan: The loaded trajectory.
        arc_m: (n,) arc lengths.
    """
    station, speed = plan.speeds.T
    i = np.clip(np.searchsorted(station, arc_m, side="right") - 1, 0, len(station) - 2)
    ahead = arc_m - station[i]
    span = np.maximum(station[i + 1] - station[i], 1e-12)
    here = np.sqrt(np.maximum(speed[i] ** 2 + (speed[i + 1] ** 2 - speed[i] ** 2) * ahead / span, 0.0))
    pace = speed[i] + here
    driven = plan.times_s[i] + np.where(pace > 0.0, 2.0 * ahead / np.maximum(pace, 1e-12), 0.0)
    turned = sum(turn.time_s * (arc_m >= plan.legs[leg].start_m) for leg, turn in plan.turns.items())
    return np.asarray(driven + turned)


def _poses(plan: LoadedTrajectory) -> tuple[Floats, Floats]:
    """Return arc lengths (n,), and x, y (m) and heading (rad) there (n, 3), no more than `STEP_M` apart."""
    arcs, poses = list[Floats](), list[Floats]()
    turned = {plan.legs[leg].first: turn for leg, turn in ((k, plan.legs[k].turn_rad) for k in plan.turns)}
    for index, row in enumerate(plan.path):
        if row[6] == 0.0:
            angles = np.linspace(0.0, turned[index], 2 + int(abs(turned[index]) / SPIN_STEP_RAD))
            arcs.append(np.full(len(angles), row[5]))
            poses.append(np.column_stack((np.full((len(angles), 2), row[:2]), row[2] + angles)))
            continue
        along = np.linspace(0.0, row[4], 2 + int(row[4] / STEP_M))
        arcs.append(row[5] + along)
        poses.append(poses_along(np.tile(row, (len(along), 1)), along))
    return np.concatenate(arcs), np.concatenate(poses)


def _holds(plan: LoadedTrajectory, vehicle: Vehicle) -> Floats:
    """Return places to wait: at the start, and between swaths, with room to brake and to regain speed.

    A covering tool works as well after a stop: with it, anywhere.
    """
    if vehicle.tool.covers:
        return np.arange(0.0, plan.total_length_m, COVER_HOLD_EVERY_M)
    work_mps = vehicle.tool.work_speed_mps
    brake_m = work_mps**2 / (2.0 * vehicle.drive.max_acceleration_mps2)
    holds = [0.0]
    for begins_m, ends_m in dry_stretches(plan):
        first_m = begins_m + brake_m if begins_m > 0.0 else 0.0
        last_m = ends_m - brake_m - SETTLE_S * work_mps
        holds += np.arange(first_m, last_m, HOLD_EVERY_M).tolist()
    return np.unique(holds)


def dry_stretches(plan: LoadedTrajectory) -> list[tuple[float, float]]:
    """Return the stretches (m) on which the plan does not paint, before, between and behind the swaths."""
    sprays = [bool(mask & Actuation.VALVE) for mask in plan.actuation]
    switches = [0.0, *plan.switch_m, plan.total_length_m]
    states = [False, *sprays]
    dry = list[tuple[float, float]]()
    for (begins_m, ends_m), sprayed in zip(pairwise(switches), states, strict=True):
        if sprayed or ends_m <= begins_m:
            continue
        if dry and dry[-1][1] == begins_m:
            dry[-1] = dry[-1][0], ends_m
        else:
            dry.append((begins_m, ends_m))
    return dry
