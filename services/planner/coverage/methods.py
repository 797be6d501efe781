"""The coverage methods that are shipped."""

import math

from touchline.services.planner.coverage.area_method import CoverageMethod
from touchline.services.planner.coverage.lap_and_lanes import CoverOptions, cover
from touchline.services.planner.coverage.zigzag import zigzag

LAP_AND_LANES = CoverageMethod(
    lambda task, progress: cover(
        task.area,
        task.boundary,
        task.obstacles,
        task.machine,
        CoverOptions(task.forward_only, task.overlap_m, task.margin_m, task.swath_angle_deg),
    )
)
ZIGZAG = CoverageMethod(
    lambda task, progress: zigzag(task.area, task.machine, angle_rad=math.radians(task.swath_angle_deg or 0.0))
)
