"""Handover: joins a trajectory to the robot's place: at its start, at standstill, or while driving, without a stop."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.onboard.estimation.filter import Estimator
from touchline.onboard.executive.localization_monitor import LocalizationMonitor
from touchline.onboard.interface import TICK_S, TICKS_PER_S
from touchline.onboard.trajectory.path import SPIN, pose_at
from touchline.onboard.trajectory.path_projection import CREEP_MPS, piece_at, pose_on
from touchline.onboard.trajectory.trajectory import LoadedTrajectory
from touchline.schemas.errors import CommandRefused

HERE_M: Final = 0.05
HERE_RAD: Final = math.radians(10.0)
"""Largest distance and turn between the standing robot and the start of a trajectory that is loaded there."""
AGREE_TICKS: Final = round(0.3 * TICKS_PER_S)
AGREE_M: Final = 0.01
AGREE_RAD: Final = math.radians(1.0)
AGREE_MPS: Final = 0.05
"""Time for which a trajectory that takes over while driving must agree with the one before, and the largest
differences."""
REACH_S: Final = 10.0
"""Largest time, at its own speeds, by which the start of the trajectory may lie behind the robot: planning and sending
take a while."""
_SAMPLE_M: Final = 0.02
_REFINEMENTS: Final = 4

Floats = NDArray[np.float64]


class NotYet(CommandRefused):
    """A trajectory cannot take over now, but one that is sent a little later may."""


class Offset(NamedTuple):
    """Difference between two poses: distance [m] and turn [rad]."""

    distance_m: float
    turn_rad: float


class PlanPlace(NamedTuple):
    """Place on a trajectory.

    Attributes:
        plan: The trajectory.
        leg: Index of the leg.
        arc_m: Arc length.
    """

    plan: LoadedTrajectory
    leg: int
    arc_m: float


def off_place(place: PlanPlace, estimator: Estimator) -> Offset:
    """Compute the difference between the estimated pose and a place of the path.

    Args:
        place: Place on the trajectory.
        estimator: Estimator of the pose.
    """
    east, north, heading = estimator.state[:3].tolist()
    x, y, wanted = pose_at(place.plan.path, place.plan.legs[place.leg], place.arc_m)
    return Offset(math.hypot(east - x, north - y), abs(math.remainder(heading - wanted, math.tau)))


def check_here(plan: LoadedTrajectory, estimator: Estimator, watch: LocalizationMonitor) -> None:
    """Check that the standing robot can begin a trajectory where it is.

    Args:
        plan: The trajectory.
        estimator: Estimator of the pose.
        watch: Monitor of the pose.

    Raises:
        CommandRefused: The robot is too far from the start, or does not know where it is.
    """
    problem = "the estimator has not started" if not estimator.started else watch.drive_problem()
    if problem:
        raise CommandRefused(f"cannot load here: {problem}; let it stand until it knows, or load without here")
    distance_m, turn_rad = off_place(PlanPlace(plan, 0, 0.0), estimator)
    if distance_m > HERE_M or turn_rad > HERE_RAD:
        east, north, heading = estimator.state[:3].tolist()
        raise CommandRefused(
            f"cannot load here: the robot stands {distance_m:.2f} m and {math.degrees(turn_rad):.1f}° away from where "
            f"the trajectory begins, at most {HERE_M:g} m and {math.degrees(HERE_RAD):.0f}° are allowed; "
            f"plan from where it stands ({east:.3f} m, {north:.3f} m, {heading:.3f} rad), or load without here"
        )


def taken_over_at(running: PlanPlace, plan: LoadedTrajectory) -> float:
    """Find the arc length at which a trajectory takes over from the one being driven.

    It is the place nearest to the running reference, not far from its start; from there on both must agree for a while.

    Args:
        running: Place of the running reference.
        plan: Trajectory that is to take over.

    Raises:
        NotYet: They differ by too much; the reason gives the differences.
        CommandRefused: It paints where the robot has been already.
    """
    sense = running.plan.legs[running.leg].sense
    if plan.legs[0].sense == SPIN or plan.legs[0].sense != sense:
        raise NotYet(
            "cannot replace under way: the trajectory does not begin in the direction in which the robot drives; "
            "let it begin with the running trajectory's next seconds, or pause or abort first"
        )
    now = reference_ahead(running)
    arc_m = _nearest_m(plan, now[0])
    distance_m, turn_rad, speed_mps = _largest_difference(now, reference_ahead(PlanPlace(plan, 0, arc_m)))
    if distance_m > AGREE_M or turn_rad > AGREE_RAD or speed_mps > AGREE_MPS:
        raise NotYet(
            f"cannot replace under way: in the next {AGREE_TICKS * TICK_S:g} s it differs from the running trajectory "
            f"by up to {100.0 * distance_m:.1f} cm, {math.degrees(turn_rad):.1f}° and {100.0 * speed_mps:.1f} cm/s, at "
            f"most {100.0 * AGREE_M:g} cm, {math.degrees(AGREE_RAD):g}° and {100.0 * AGREE_MPS:g} cm/s are allowed; "
            "let it begin with the running trajectory's next seconds, and send it in time"
        )
    if plan.first_spray_between(0.0, arc_m) is not None:
        raise CommandRefused(
            "cannot replace under way: the trajectory paints behind the robot; plan it from further on"
        )
    return arc_m


def reference_ahead(place: PlanPlace) -> Floats:
    """Compute (AGREE_TICKS + 1, 4) x, y [m], heading [rad] and speed [m/s] of a plan from a place on, tick by tick.

    At the end of the leg it stands.
    """
    plan, leg, arc_m = place
    pieces, own = plan.pieces[leg], plan.legs[leg]
    rows = np.zeros((AGREE_TICKS + 1, 4))
    for row in rows:
        speed_mps = plan.speed_at(arc_m)
        row[:] = *pose_on(pieces, float(own.sense), piece_at(pieces, 0, arc_m), arc_m), speed_mps
        arc_m = min(arc_m + TICK_S * max(speed_mps, CREEP_MPS), own.end_m)
    return rows


def _nearest_m(plan: LoadedTrajectory, pose: Floats) -> float:
    """Find the arc length of the first leg, within REACH_S of its start, that is nearest to a pose (x m, y m, …)."""
    leg, pieces = plan.legs[0], plan.pieces[0]
    soon = plan.speeds[plan.times_s <= REACH_S, 0]
    reach_m = min(float(soon[-1]) + REACH_S * float(plan.speeds[len(soon) - 1, 1]), leg.end_m)
    stations = np.append(np.arange(0.0, reach_m, _SAMPLE_M), reach_m).tolist()
    sense = float(leg.sense)

    def along_m(arc_m: float) -> tuple[float, float]:
        x, y, heading = pose_on(pieces, sense, piece_at(pieces, 0, arc_m), arc_m)
        east, north = pose[0] - x, pose[1] - y
        return math.hypot(east, north), sense * (east * math.cos(heading) + north * math.sin(heading))

    nearest_m: float = min(stations, key=lambda arc_m: along_m(arc_m)[0])
    for _ in range(_REFINEMENTS):
        nearest_m = min(max(nearest_m + along_m(nearest_m)[1], 0.0), reach_m)
    return nearest_m


def _largest_difference(one: Floats, other: Floats) -> tuple[float, float, float]:
    """Compute the largest differences in position [m], heading [rad], speed [m/s]; both (n, 4) of `reference_ahead`."""
    apart = other - one
    turned = np.abs(np.remainder(apart[:, 2] + math.pi, math.tau) - math.pi)
    return float(np.hypot(apart[:, 0], apart[:, 1]).max()), float(turned.max()), float(np.abs(apart[:, 3]).max())
