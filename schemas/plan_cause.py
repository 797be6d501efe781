"""What a plan was made from, besides its template and vehicle: with these anybody can plan it again."""

from __future__ import annotations

import math
from typing import Any

from pydantic import field_validator

from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.spec import Spec


class PlanCause(Spec):
    """The options of a plan, and the goal of one that leads to a pose."""

    options: PlanOptions = PlanOptions()
    goal: PoseGoal | None = None

    @field_validator("options", "goal", mode="before")
    @classmethod
    def _with_its_blanks(cls, given: Any) -> Any:
        """A number that is left open (a goal without a heading) is NaN, which JSON has as null."""
        if not isinstance(given, dict):
            return given
        return {name: math.nan if value is None else value for name, value in given.items()}
