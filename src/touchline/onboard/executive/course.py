"""Course: a checked trajectory with the fence round it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from touchline.onboard.executive.geofence import Geofence
from touchline.onboard.trajectory.trajectory import LoadedTrajectory, load_trajectory
from touchline.schemas.messages import Trajectory
from touchline.schemas.onboard import FenceLimits
from touchline.schemas.vehicles import Vehicle


class Course(NamedTuple):
    """Checked trajectory with the fence round it, and the outlines of the things that its plan keeps off."""

    plan: LoadedTrajectory
    fence: Geofence
    obstacles: Sequence[Sequence[tuple[float, float]]] = ()


def prepare_course(
    trajectory: Trajectory, boundary: Sequence[tuple[float, float]], vehicle: Vehicle, limits: FenceLimits
) -> Course:
    """Check a trajectory, which may take seconds, and make its fence.

    Args:
        trajectory: Path, speeds and actuation.
        boundary: Corners (x, y) [m] of the area that the robot is not to leave; if empty, the plan's surroundings.
        vehicle: The nominal robot.
        limits: Margins of the fence.

    Raises:
        CommandRefused: The trajectory cannot be driven; the reason says why.
    """
    plan = load_trajectory(trajectory, vehicle)
    return Course(plan, Geofence(plan.path, boundary, vehicle, limits))
