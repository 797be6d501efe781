"""Heading slices: positions of a body over an interval of headings, bracketed from both sides.

The tight bracket holds positions at which the body is free at every heading of the interval, the loose one all
positions at which it is free at some heading, and more. Both are polygons: ground less Minkowski sums of obstructed
parts and the mirrored body (Lozano-Pérez, "Spatial planning: a configuration space approach", IEEE Transactions on
Computers C-32(2), 1983).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from touchline.core.robust_overlay import as_area, buffer, difference, union
from touchline.services.planner.free_space.obstructed_ground import ObstructedGround
from touchline.services.planner.geometry.clothoid import Floats, Ints

CLEARANCE_M = 1e-3
"""Clearance of the body at all positions of the tight bracket, so that motions can be checked in spite of rounding."""

Interval = tuple[float, float]
Parts = np.ndarray[tuple[int], np.dtype[np.object_]]


@dataclass(frozen=True)
class HeadingSlice:
    """Positions of the body's origin over an interval of headings (rad).

    Attributes:
        interval: Lowest and highest heading.
        tight: Polygons in each of which the body is free, by `CLEARANCE_M`, at every heading of the interval.
        loose: Polygons that hold all positions at which the body is free at some heading of the interval.
        within: (tight,) index of the loose polygon that each tight one lies in.
    """

    interval: Interval
    tight: Parts
    loose: Parts
    within: Ints


class Slicer:
    """Makes the slices of a body on a ground."""

    def __init__(self, ground: ObstructedGround, parts: Sequence[Floats]) -> None:
        """Take a body and its ground.

        Args:
            ground: The ground.
            parts: (n, 2) corners of the convex parts of the body, counter-clockwise, in its own frame (m).
        """
        self._ground, self._parts = ground, parts
        self._count = np.array([len(each) for each in ground.obstructed])
        self._corners = np.concatenate([np.empty((0, 2)), *ground.obstructed])
        reach_m = max((float(np.hypot(*part.T).max()) for part in parts), default=0.0)
        self._reach_m = reach_m

    def slice(self, interval: Interval) -> HeadingSlice:
        """Make the slice of an interval of headings (rad)."""
        low, high = interval
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        tight = shapely.get_parts(self._places([_covering(part, middle, half) for part in self._parts]))
        loose = shapely.get_parts(self._places([self._contained(part, middle, half) for part in self._parts]))
        inside = np.asarray(shapely.point_on_surface(tight))
        tree = shapely.STRtree(loose)
        within = np.zeros(len(tight), np.int64)
        found, of = tree.query(inside, predicate="intersects") if len(tight) else (within, within)
        within[found] = of
        return HeadingSlice(interval, tight, loose, within)

    def _contained(self, part: Floats, middle: float, half: float) -> BaseGeometry:
        """Part of the body that is covered at every heading of an interval."""
        turned = shapely.polygons(np.array([_turned(part, middle + turn) for turn in (-half, 0.0, half)]))
        # Between two of the three headings, half/2 from the nearer one, an edge cuts off this much more.
        return buffer(shapely.intersection_all(turned), -self._reach_m * half**2 / 8.0, join_style="mitre")

    def _places(self, body: Sequence[BaseGeometry]) -> shapely.Polygon | shapely.MultiPolygon:
        """Positions at which convex shapes of a body are off the obstructed ground."""
        hits = [self._sums(shapely.get_coordinates(shape)[:-1]) for shape in body if not shape.is_empty]
        return as_area(difference(self._ground.free, union(np.concatenate([np.empty(0, object), *hits]))))

    def _sums(self, shape: Floats) -> Parts:
        """Minkowski sums of the obstructed parts and the mirrored shape."""
        sums = (self._corners[:, None] - shape[None]).reshape(-1, 2)
        number = np.repeat(np.arange(len(self._count)), self._count * len(shape))
        return np.asarray(shapely.convex_hull(shapely.linestrings(sums, indices=number)))


def _covering(part: Floats, middle: float, half: float) -> BaseGeometry:
    """Convex shape that covers a convex part of the body, and `CLEARANCE_M` round it, at every heading of an interval.

    The arc of a corner lies in the triangle of its ends and the crossing of the tangents there.
    """
    corners = (_turned(part, middle - half), _turned(part, middle) / math.cos(half), _turned(part, middle + half))
    hull = shapely.MultiPoint(np.concatenate(corners)).convex_hull
    return buffer(hull, CLEARANCE_M, join_style="mitre")


def _turned(points: Floats, heading_rad: float) -> Floats:
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    return np.asarray(points @ np.array([[cos, sin], [-sin, cos]]))
