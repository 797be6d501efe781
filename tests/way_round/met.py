"""A person on a line of a short job, or in a yard, and robots with a lidar that meet them."""

import math
from typing import Any

import numpy as np

from tests.planner.drawn import drawn
from touchline.schemas.messages import PlanOptions
from touchline.schemas.scenario import Scenario
from touchline.schemas.setup import Setup
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle

LIDAR = {"kind": "lidar", "name": "front", "x_m": 0.4, "beams": 360, "step_rad": math.pi / 180, "systematic_m": 0.03}
MARKER = Vehicle.model_validate({"name": "marker", "sensors": [LIDAR]})
FIELD = drawn((0, 0, 12, 0), (12, 4, 0, 4))
PERSON = {"kind": "person", "name": "groundsman", "x_m": 6.0, "y_m": 0.0}
SWEEPER = Vehicle.model_validate(
    {"name": "sweeper", "sensors": [LIDAR], "tool": {"kind": "roller", "rolled_width_m": 1.0}}
)
YARD = Template.model_validate({"name": "yard", "areas": [{"id": "yard", "outline": [[0, 0], [9, 0], [9, 6], [0, 6]]}]})
QUICK = PlanOptions(coverage_pct=90.0, laps=1, swath_angle_deg=np.array([0.0]))
"""Options for the yard: touching up takes longest, and is left out."""
IN_YARD = {**PERSON, "x_m": 6.1, "y_m": 3.0}


def meeting(*objects: dict[str, Any]) -> Setup:
    """The marker in a world with these objects."""
    return Setup(vehicle=MARKER, scenario=Scenario.model_validate({"seed": 5, "objects": objects}))


def leaving(start_s: float) -> dict[str, Any]:
    """The person, who walks off at a time."""
    return {**PERSON, "motion": {"kind": "path", "points": [[6.0, -12.0]], "start_s": start_s}}
