"""A job that is ready to be taken: course, start, and the ledger that its paint is entered in."""

from __future__ import annotations

import math
from collections.abc import Collection
from enum import Enum, auto
from typing import Any, NamedTuple

from touchline.onboard.interface import Checkpoint
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import Trajectory
from touchline.schemas.plan_cause import PlanCause
from touchline.schemas.template import DEFAULT_TOLERANCE_M, Polygon, Template
from touchline.schemas.vehicles import ToolSpec, Vehicle
from touchline.services.robot_sim.accounting.area_account import AreaAccount
from touchline.services.robot_sim.paint.ledger import PaintLedger
from touchline.services.robot_sim.paint.targets import Target, start_pose, targets
from touchline.services.robot_sim.recovery_state import EarlierWork


class Taking(Enum):
    """Way to get to the start of a trajectory."""

    CARRIED = auto()
    """The robot is carried to the start, or to where a job continues."""
    HERE = auto()
    """The robot stands there."""
    UNDER_WAY = auto()
    """The robot drives along another trajectory, and continues on this one."""


class LoadedJob(NamedTuple):
    """A trajectory and its lines to be painted, checked and ready to be taken.

    Attributes:
        course: Course of the onboard computer.
        start: (x m, y m, heading rad) of the robot.
        ledger: Ledger for its paint; of a job that continues, with the paint so far.
        account: Account of its areas, if a covering tool works on any.
        resume, earlier: Checkpoint and earlier work of a job that continues.
        taking: Way to get to the start.
        cause: Request that the plan was made from, if known.
        obstacles: Obstacles of its template.
    """

    course: Any
    start: tuple[float, float, float]
    ledger: PaintLedger
    account: AreaAccount | None
    resume: Checkpoint | None
    earlier: EarlierWork | None
    taking: Taking = Taking.CARRIED
    cause: PlanCause | None = None
    obstacles: tuple[Polygon, ...] = ()


def lines_and_start(
    trajectory: Trajectory, template: Template | None, vehicle: Vehicle, left_out: Collection[str]
) -> tuple[list[Target], tuple[float, float, float]]:
    """Return the lines to be painted, and the pose (x m, y m, heading rad) at which a trajectory begins.

    Args:
        trajectory: Path, speeds and actuation.
        template: Template to evaluate the work by; None: the trajectory itself.
        vehicle: The nominal robot.
        left_out: Lines of the template that the plan leaves out.

    Raises:
        CommandRefused: The trajectory cannot be driven.
    """
    try:
        return targets(trajectory, template, vehicle, left_out), start_pose(trajectory)
    except ValueError as error:
        raise CommandRefused(f"the trajectory cannot be driven: {error}") from error


def ledger_of(wanted: list[Target], template: Template | None, tool: ToolSpec) -> PaintLedger:
    """Return an empty ledger for the paint of these lines, by the width and tolerance of their template, if any."""
    width_m = template.line_width_m if template is not None else tool.width_m
    tolerance_m = template.tolerance_m if template is not None else DEFAULT_TOLERANCE_M
    return PaintLedger(wanted, width_m, tool.width_m, tolerance_m, thins=tool.covers)


def place_of(point_m: tuple[float, float], pose: tuple[float, float, float]) -> tuple[float, float]:
    """Return the place of a point of the robot in the map."""
    (east_m, north_m, heading_rad), (x_m, y_m) = pose, point_m
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    return east_m + cos * x_m - sin * y_m, north_m + sin * x_m + cos * y_m
