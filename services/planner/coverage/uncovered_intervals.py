"""Uncovered intervals along a straight, in an area of which a part has been covered before."""

from typing import Final

import numpy as np
import shapely

from touchline.core.robust_overlay import as_area, intersection
from touchline.services.planner.coverage.shapes import Area, turned
from touchline.services.planner.geometry.clothoid import PathPose

GAP_M: Final = 12.0
"""A straight continues over a shorter gap, which costs less than a turn."""
INTERVAL_MIN_M2: Final = 0.3
"""An interval with less to cover is dropped: turns and touching up cover it."""


def uncovered_intervals(
    remaining: Area, pose: PathPose, length_m: float, half_width_m: float
) -> list[tuple[float, float]]:
    """Intervals (m, along the heading) of a straight from a pose in which there is something to cover.

    Args:
        remaining: Ground still to be covered (m, map frame).
        pose: Start of the straight (m, rad, map frame).
        length_m: Its length.
        half_width_m: Half the width of the tool.
    """
    strip = shapely.transform(
        shapely.box(0.0, -half_width_m, length_m, half_width_m),
        lambda points: turned(points, pose.heading_rad) + pose[:2],
    )
    found = list[tuple[float, float, float]]()
    for part in shapely.get_parts(as_area(intersection(remaining, strip))):
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
    return [(first, last) for first, last, area_m2 in merged if area_m2 >= INTERVAL_MIN_M2]
