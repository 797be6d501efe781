"""Inputs of a plan besides its template and vehicle: with them it can be planned again."""

from __future__ import annotations

import math
from typing import Any, Self

from pydantic import field_validator

from touchline.schemas.ground_piece import GroundPiece
from touchline.schemas.known_ground import OPEN_GROUND, KnownGround, KnownObstacle
from touchline.schemas.messages import LeavingTrajectory, PlanOptions, PlanReport, PoseGoal, WaySearch
from touchline.schemas.spec import GrownSpec, Spec


class LeftDrive(Spec):
    """Place at which a plan leaves the drive before it."""

    arc_length_m: float
    """Arc length, m, that the robot had come to."""
    keep_s: float
    """Time, s, for which the drive is kept as it was."""

    @classmethod
    def of(cls, leaving: LeavingTrajectory) -> Self:
        """That of a request, without the drive itself: the recording has it already."""
        return cls(arc_length_m=leaving.arc_length_m, keep_s=leaving.keep_s)


class PlanCause(GrownSpec):
    """Options of a plan, goal of one that leads to a pose, the lines left out in part or whole, and known ground.

    A plan to a goal without a start in the options leaves another drive, at ``leaves``. The known ground of a
    template's plan is what its robot had seen besides the template's own outlines. With ``remaining`` pieces these are
    what is to be covered of the template's areas. A calibration drive has its start in the options.
    ``known`` are the obstacles that a request without a template named: they stand, and the ground may have what the
    robot had seen besides.
    """

    options: PlanOptions = PlanOptions()
    goal: PoseGoal | None = None
    left_out: tuple[str, ...] = ()
    ground: KnownGround = OPEN_GROUND
    remaining: tuple[GroundPiece, ...] = ()
    search: WaySearch = WaySearch()
    leaves: LeftDrive | None = None
    calibration: bool = False
    known: tuple[KnownObstacle, ...] = ()

    later_fields = ("ground", "remaining", "search", "leaves", "calibration", "known")

    @classmethod
    def of(cls, options: PlanOptions, report: PlanReport) -> Self:
        """That of a plan of a template, by its report."""
        return cls(options=options, left_out=tuple(dict.fromkeys(each.line_id for each in report.left_out)))

    @field_validator("options", "goal", mode="before")
    @classmethod
    def _with_its_blanks(cls, given: Any) -> Any:
        """A number that is left open (a goal without a heading) is NaN, which JSON has as null."""
        if not isinstance(given, dict):
            return given
        return {name: math.nan if value is None else value for name, value in given.items()}
