"""Laps: straights along the edges of an area, as close to them as the machine may be."""

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import shapely

from touchline.core.robust_overlay import buffer
from touchline.services.planner.coverage.cover_stroke import CoverStroke
from touchline.services.planner.coverage.coverage_route import DriveKind
from touchline.services.planner.coverage.free_space import FreeSpace
from touchline.services.planner.coverage.lanes import CoverLane
from touchline.services.planner.coverage.shapes import Area
from touchline.services.planner.coverage.uncovered_intervals import uncovered_intervals
from touchline.services.planner.geometry.clothoid import PathPose

# Row number of sides, which lie in no row.
NO_ROW = -1_000
# A shorter side (m) is not laid: lanes and touching up cover it.
SIDE_MIN_M = 0.5


def rings(target: Area, width_m: float) -> list[shapely.LinearRing]:
    """Path of the tool's middle along each outline and hole: closed lines with the inside on the left.

    The outline of the largest part comes first; parts narrower than the tool have none.
    """
    inner = buffer(target, -0.5 * width_m, join_style="mitre", mitre_limit=3.0)
    parts = sorted(shapely.get_parts(shapely.orient_polygons(inner)), key=shapely.area, reverse=True)
    return [ring for part in parts if not part.is_empty for ring in (part.exterior, *part.interiors)]


def sides(ring: shapely.LinearRing, name: str, space: FreeSpace, remaining: Area | None = None) -> list[CoverLane]:
    """Lay a stroke in each direction along each side of a ring, from the tail at the wall to the nose at the wall.

    Args:
        ring: Closed line with the inside on the left (m, map frame); the sides lie in its order.
        name: Beginning of the labels.
        space: Free space of the machine.
        remaining: Ground still to be covered (m, map frame); None: all of it.
    """
    found: list[CoverLane] = []
    corners = [complex(*p) for p in shapely.get_coordinates(ring).tolist()]
    edges = pairwise(_without_straight_corners(corners))
    for a, b in (part for edge in edges for part in _uncovered(*edge, remaining, 0.5 * space.machine.width_m)):
        for start, length in _along(a, b, space):
            # The same stretch in the opposite direction: nose and tail change places.
            end = start.moved(complex(length, 0.0), 0.0)
            others = [(abs(s.point - end.point), s, m) for s, m in _along(b, a, space)]
            if others:
                _, other, other_m = min(others)
                label = f"{name}, side {len(found) + 1}"
                along = CoverStroke(DriveKind.LAP, label, start, length)
                found.append(CoverLane(along, CoverStroke(DriveKind.LAP, label, other, other_m), NO_ROW))
    return found


def _uncovered(
    a: complex, b: complex, remaining: Area | None, half_width_m: float
) -> Iterator[tuple[complex, complex]]:
    """Parts of a side along which more is uncovered than its neighbours cover in the corners."""
    if remaining is None or a == b:
        yield a, b
        return
    ahead = (b - a) / abs(b - a)
    pose = PathPose(a.real, a.imag, math.atan2(ahead.imag, ahead.real))
    for first, last in uncovered_intervals(remaining, pose, abs(b - a), half_width_m):
        if last - first > half_width_m + SIDE_MIN_M:
            yield a + first * ahead, a + last * ahead


def _along(a: complex, b: complex, space: FreeSpace) -> Iterator[tuple[PathPose, float]]:
    """Start poses and lengths (m) of the free stretches along a side, up to half the tool's width beyond its ends."""
    beyond, length = 0.5 * space.machine.width_m, abs(b - a)
    if length < SIDE_MIN_M:
        return
    pose = PathPose(a.real, a.imag, math.atan2((b - a).imag, (b - a).real))
    for first, last in space.stretches(pose, length + beyond, beyond):
        if min(last, length) - max(first, 0.0) >= SIDE_MIN_M:
            yield pose.moved(complex(first, 0.0), 0.0), last - first


def _without_straight_corners(corners: list[complex]) -> list[complex]:
    """Remove the corners of a closed line (first point repeated at its end) at which it goes straight on."""
    open_line = corners[:-1]
    kept = [
        here
        for before, here, after in zip(
            open_line[-1:] + open_line, open_line, open_line[1:] + open_line[:1], strict=False
        )
        if abs(np.angle((after - here) / (here - before))) > 1e-6
    ]
    return [*kept, kept[0]]
