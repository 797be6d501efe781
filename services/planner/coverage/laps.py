"""Laps: straights along the edges of an area, as near to them as the machine may be."""

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import shapely

from touchline.services.planner.coverage.cover_stroke import CoverStroke
from touchline.services.planner.coverage.coverage_route import DriveKind
from touchline.services.planner.coverage.free_space import Area, FreeSpace
from touchline.services.planner.geometry.clothoid import PathPose

# A shorter side (m) is left to the lanes and to touching up.
SIDE_MIN_M = 0.5


def rings(target: Area, width_m: float) -> list[shapely.LinearRing]:
    """The middle of the tool's way along each edge, a closed line for the outline and each hole, inside on the left."""
    inner = target.buffer(-0.5 * width_m, join_style="mitre", mitre_limit=3.0)
    parts = [shapely.geometry.polygon.orient(part) for part in shapely.get_parts(inner)]
    return [ring for part in parts for ring in (part.exterior, *part.interiors)]


def sides(ring: shapely.LinearRing, name: str, space: FreeSpace, *, turned: bool = False) -> list[CoverStroke]:
    """A stroke for each side of a ring, from where the tail is at the wall to where the nose is.

    Args:
        ring: With the inside on the left.
        name: What the labels begin with.
        space: Where the machine may be.
        turned: Driven the other way round, the inside on the right.
    """
    points = shapely.get_coordinates(ring)
    corners = [complex(*p) for p in (points[::-1] if turned else points).tolist()]
    found: list[CoverStroke] = []
    for a, b in pairwise(_without_straight_corners(corners)):
        for start, length in _along(a, b, space):
            found.append(CoverStroke(DriveKind.LAP, f"{name}, side {len(found) + 1}", start, length))
    return found


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
