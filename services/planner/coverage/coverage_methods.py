"""Shipped coverage methods."""

import math
from collections.abc import Callable

import shapely

from touchline.schemas.errors import PlanningError
from touchline.services.planner.coverage.area_method import CoverageMethod
from touchline.services.planner.coverage.coverage_route import CoverageRoute
from touchline.services.planner.coverage.coverage_task import CoverageTask
from touchline.services.planner.coverage.lap_and_lanes import cover
from touchline.services.planner.coverage.zigzag import zigzag


def _zigzag(task: CoverageTask, _progress: Callable[[float], None]) -> CoverageRoute:
    if task.forward_only:
        raise PlanningError("", "cannot be planned by zigzag forward only", "use lap-and-lanes, or let it reverse")
    if task.start is not None or task.remaining is not None:
        raise PlanningError("", "cannot be planned by zigzag from a start pose", "use lap-and-lanes, or leave it out")
    if not isinstance(task.area, shapely.Polygon):
        raise PlanningError("", "cannot be planned by zigzag for a part in several pieces", "use lap-and-lanes")
    return zigzag(task.area, task.machine, angle_rad=math.radians(task.swath_angle_deg or 0.0))


LAP_AND_LANES, ZIGZAG = CoverageMethod(cover), CoverageMethod(_zigzag)
