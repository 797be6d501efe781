"""The inputs of a plan come through a file as they were, numbers that are left open, too."""

import math

import pytest

from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.plan_cause import PlanCause


@pytest.mark.parametrize("heading_rad", [1.2, math.nan])
def test_it_comes_through_json(heading_rad):
    goal = PoseGoal(x_m=1.0, y_m=-2.0, heading_rad=heading_rad, method="cubic")
    options = PlanOptions(paint_speed_mps=0.7, start=(1.0, 2.0, 0.5))
    found = PlanCause.model_validate_json(PlanCause(options=options, goal=goal).model_dump_json())
    assert found.goal.model_dump_json() == goal.model_dump_json()
    assert math.isnan(found.goal.heading_rad) == math.isnan(heading_rad)
    assert found.options.model_dump_json() == options.model_dump_json()
