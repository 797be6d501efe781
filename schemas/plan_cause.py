"""What a plan was made from, besides its template and vehicle: with these anybody can plan it again."""

from __future__ import annotations

from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.spec import Spec


class PlanCause(Spec):
    """The options of a plan, and the goal of one that leads to a pose."""

    options: PlanOptions = PlanOptions()
    goal: PoseGoal | None = None
