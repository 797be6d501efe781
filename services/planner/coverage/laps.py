"""Laps: straights along the edges of an area, as near to them as the machine may be."""

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
from touchline.services.planner.coverage.left_along import left_along
from touchline.services.planner.coverage.shapes import Area
from touchline.services.planner.geometry.clothoid import PathPose

# Sides lie in no row.
NO_ROW = -1_000
# A shorter side (m) is left to the lanes and to touching up.
SIDE_MIN_M = 0.5


def rings(target: Area, width_m: float) -> list[shapely.LinearRing]:
    """The middle of the tool's way along each edge, a closed line for each outline and hole, inside on the left.

    The outline of the largest part comes first; there is none where the tool is wider than what there is.
    """
    inner = buffer(target, -0.5 * width_m, join_style="mitre", mitre_limit=3.0)
    parts = sorted(shapely.get_parts(shapely.orient_polygons(inner)), key=shapely.area, reverse=True)
    return [ring for part in parts if not part.is_empty for ring in (part.exterior, *part.interiors)]


def sides(ring: shapely.LinearRing, name: str, space: FreeSpace, left: Area | None = None) -> list[CoverLane]:
    """A stroke each way for each side of a ring, from where the tail is at the wall to where the nose is.

    Args:
        ring: With the inside on the left; the sides lie in its order.
        name: What the labels begin with.
        space: Where the machine may be.
        left: What is to be covered, if not everything.
    """
    found: list[CoverLane] = []
    corners = [complex(*p) for p in shapely.get_coordinates(ring).tolist()]
    edges = pairwise(_without_straight_corners(corners))
    for a, b in (part for edge in edges for part in _left_of(*edge, left, 0.5 * space.machine.width_m)):
        for start, length in _along(a, b, space):
            # The same stretch the other way: nose and tail change places.
            end = start.moved(complex(length, 0.0), 0.0)
            others = [(abs(s.point - end.point), s, m) for s, m in _along(b, a, space)]
            if others:
                _, other, other_m = min(others)
                label = f"{name}, side {len(found) + 1}"
                along = CoverStroke(DriveKind.LAP, label, start, length)
                found.append(CoverLane(along, CoverStroke(DriveKind.LAP, label, other, other_m), NO_ROW))
    return found


def _left_of(a: complex, b: complex, left: Area | None, half_width_m: float) -> Iterator[tuple[complex, complex]]:
    """The parts of a side along which more is left than what its neighbours cover in the corners."""
    if left is None or a == b:
        yield a, b
        return
    ahead = (b - a) / abs(b - a)
    pose = PathPose(a.real, a.imag, math.atan2(ahead.imag, ahead.real))
    for first, last in left_along(left, pose, abs(b - a), half_width_m):
        if last - first > half_width_m + SIDE_MIN_M:
            yield a + first * ahead, a + last * ahead


def _along(a: complex, b: complex, space: FreeSpace) -> Iterator[tuple[PathPose, float]]:
    """Where the machine may drive along a side: as far beyond its ends as the tool's half width."""
    beyond, length = 0.5 * space.machine.width_m, abs(b - a)
    if length < SIDE_MIN_M:
        return
    pose = PathPose(a.real, a.imag, math.atan2((b - a).imag, (b - a).real))
    for first, last in space.stretches(pose, length + beyond, beyond):
        if min(last, length) - max(first, 0.0) >= SIDE_MIN_M:
            yield pose.moved(complex(first, 0.0), 0.0), last - first


def _without_straight_corners(corners: list[complex]) -> list[complex]:
    """A closed line (its first point again at its end) without the corners that are none."""
    open_line = corners[:-1]
    kept = [
        here
        for before, here, after in zip(
            open_line[-1:] + open_line, open_line, open_line[1:] + open_line[:1], strict=False
        )
        if abs(np.angle((after - here) / (here - before))) > 1e-6
    ]
    return [*kept, kept[0]]
