"""The salt pan and its roller, as the specification gives them, and how much of a field a route covers."""

import math

import shapely

from touchline.services.planner.coverage.coverage_machine import CoverageMachine
from touchline.services.planner.coverage.coverage_route import CoverageRoute
from touchline.services.planner.coverage.swept_area import Area, swept

BODY = ((0.4, 1.1), (-0.4, 1.1), (-0.4, 0.6), (-2.5, 0.6), (-2.5, -0.6), (-0.4, -0.6), (-0.4, -1.1), (0.4, -1.1))
ROLLER = CoverageMachine(
    width_m=2.2,
    outline=BODY,
    curvature_max_1pm=math.tan(0.5) / 2.0,
    sharpness_max_1pm2=0.25,
    speed_mps=1.0,
    acceleration_mps2=0.1,
)
PAN = shapely.box(-46.5, -23.8, 46.5, 23.8)


def covered_pct(route: CoverageRoute, area: Area) -> float:
    """Per cent of an area that the tool passes over, exactly."""
    covered = swept([piece.path for piece in route.pieces], ROLLER.width_m)
    return 100.0 * float(covered.intersection(area).area / area.area)
