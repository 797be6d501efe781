"""Inputs of a plan besides its template and vehicle: with them it can be planned again."""

from __future__ import annotations

import math
from typing import Any, Self

from pydantic import field_validator

from touchline.schemas.ground_piece import GroundPiece
from touchline.schemas.known_ground import OPEN_GROUND, KnownGround
from touchline.schemas.messages import PlanOptions, PlanReport, PoseGoal
from touchline.schemas.spec import GrownSpec


class PlanCause(GrownSpec):
    """Options of a plan, goal of one that leads to a pose, the lines left out in part or whole, and known ground.

    The known ground of a template's plan is what its robot had seen besides the template's own outlines. With
    ``remaining`` pieces these are what is to be covered of the template's areas.
    """

    options: PlanOptions = PlanOptions()
    goal: PoseGoal | None = None
    left_out: tuple[str, ...] = ()
    ground: KnownGround = OPEN_GROUND
    remaining: tuple[GroundPiece, ...] = ()

    later_fields = ("ground", "remaining")

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
