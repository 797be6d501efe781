"""Of an area of which much has been covered before: where along a straight there is something left."""

from typing import Final

import numpy as np
import shapely

from touchline.core.robust_overlay import intersection
from touchline.services.planner.coverage.shapes import Area, as_area, turned
from touchline.services.planner.geometry.clothoid import PathPose

GAP_M: Final = 12.0
"""A straight goes on over a shorter gap: a turn is worth as much."""
LEAST_M2: Final = 0.3
"""Less is left to turns and to touching up."""


def left_along(left: Area, pose: PathPose, length_m: float, half_width_m: float) -> list[tuple[float, float]]:
    """From where to where (m, along the heading) a straight from a pose has something to cover.

    Args:
        left: That is to be covered.
        pose: Where it begins.
        length_m: Of the straight.
        half_width_m: So far to each side it covers.
    """
    strip = shapely.transform(
        shapely.box(0.0, -half_width_m, length_m, half_width_m),
        lambda points: turned(points, pose.heading_rad) + pose[:2],
    )
    found = list[tuple[float, float, float]]()
    for part in shapely.get_parts(as_area(intersection(left, strip))):
        if part.is_empty:
            continue
        along = turned(shapely.get_coordinates(part) - pose[:2], -pose.heading_rad)[:, 0]
        found.append((float(np.min(along)), float(np.max(along)), float(part.area)))
    merged = list[tuple[float, float, float]]()
    for first, last, area_m2 in sorted(found):
        if merged and first - merged[-1][1] < GAP_M:
            begun, ended, before_m2 = merged.pop()
            merged.append((begun, max(ended, last), before_m2 + area_m2))
        else:
            merged.append((first, last, area_m2))
    return [(first, last) for first, last, area_m2 in merged if area_m2 >= LEAST_M2]
