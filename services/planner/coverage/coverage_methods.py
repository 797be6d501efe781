"""The coverage methods that are shipped."""

import math
from collections.abc import Callable

from touchline.schemas.errors import PlanningError
from touchline.services.planner.coverage.area_method import CoverageMethod
from touchline.services.planner.coverage.coverage_route import CoverageRoute
from touchline.services.planner.coverage.coverage_task import CoverageTask
from touchline.services.planner.coverage.lap_and_lanes import CoverOptions, cover
from touchline.services.planner.coverage.zigzag import zigzag

# What is missed is touched up until so much of what can be reached is covered, where nobody says how much.
CHEAP_PCT = 99.0


def _lap_and_lanes(task: CoverageTask, progress: Callable[[float], None]) -> CoverageRoute:
    wanted_pct = task.coverage_pct or CHEAP_PCT
    options = CoverOptions(
        task.forward_only, task.overlap_m, task.margin_m, task.swath_angle_deg, wanted_pct, task.laps
    )
    return cover(task.area, task.boundary, task.obstacles, task.machine, options, progress)


def _zigzag(task: CoverageTask, _progress: Callable[[float], None]) -> CoverageRoute:
    if task.forward_only:
        raise PlanningError("", "cannot be planned by zigzag forward only", "use lap-and-lanes, or let it reverse")
    return zigzag(task.area, task.machine, angle_rad=math.radians(task.swath_angle_deg or 0.0))


LAP_AND_LANES, ZIGZAG = CoverageMethod(_lap_and_lanes), CoverageMethod(_zigzag)
