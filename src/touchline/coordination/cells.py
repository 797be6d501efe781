"""Cells of robots: Voronoi cells for deployment, and buffered cells that robots keep to, with room to stop.

Voronoi cell of robot i: all of the area that is nearer to p_i than to any other robot, straight across obstacles.

Buffered cell: with S_i the *stopping segment*, from p_i to where robot i would stand if it braked straight ahead now,
for each pair the nearest points a of S_i and b of S_j, n = (b − a)/|b − a| and m = (a + b)/2, robot i keeps to (q −
m)·n ≤ −r and robot j to the other side, r = min(r_s, |b − a|/2). Sides of the area are moved in by r_s, or so far as
S_i lets them. While everybody keeps to its cell, which it can as braking is always permitted, S_i stays in the old cell
i, S_j in the old cell j, and so with every update |b − a| ≥ min(2·r_s, what it was before). docs/explanation/teams.md
has the proof. After Zhou, Wang, Bandyopadhyay, Schwager, "Fast, on-line collision avoidance for dynamic vehicles
using buffered Voronoi cells", IEEE Robotics and Automation Letters 2(2), 2017, whose cells are of points.

A buffered cell is convex. Where the area is not, it is a convex part of the free area round S_i: walls cut from it, in
order of nearness, whatever lies behind the line through the wall's nearest point. So behind a corner nothing is in the
cell, and a goal there is not reached by going to the cell's nearest point: that needs a path planned elsewhere.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.free_area import FreeArea
from touchline.coordination.kernels.clipping import clip
from touchline.coordination.kernels.nearest import nearest_in
from touchline.coordination.kernels.partition import bisecting, keep_apart, surrounded
from touchline.core.half_planes import OFFSET, excess_m
from touchline.core.polygons import apart_squared
from touchline.schemas.errors import TouchlineError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

ROBOT_RADIUS_M: Final = 0.2
"""Default of r_s: a body of 0.177 m, and 23 mm for errors of estimate and follower and for latency."""


# A side this near to the polygon (m) counts as touching.
_TOUCHES_M: Final = 1e-6


class SegmentsMeet(TouchlineError):
    """Robots whose stopping segments meet, or one whose segment meets a wall: no cells can keep them apart."""

    def __init__(self, first: str, second: str) -> None:
        self.first, self.second = first, second
        super().__init__(f"robot {first} is about to run into {second}; stop them and move them apart")


class CoincidentPoints(TouchlineError):
    """Two robots at the same place, where neither is nearer to anything."""


class VoronoiParts(NamedTuple):
    """Voronoi cells, each in as many convex parts as the area has pieces; a part may have no corners.

    Attributes:
        corners: (n, p, m, 2) counter-clockwise, m, map frame.
        counts: (n, p) number of corners of each part.
    """

    corners: Floats
    counts: Ints


class BufferedCell(NamedTuple):
    """Buffered cell of one robot.

    Attributes:
        half_planes: (k, 3) n·q ≤ offset: outward unit normal, offset (m); a row of zeros has no effect.
        corners: (c, 2) of the polygon, counter-clockwise (m); empty if rounding leaves nothing of it.
        roomy: (d, 2) the part that keeps the whole radius from the border and walls, if there is one.
    """

    half_planes: Floats
    corners: Floats
    roomy: Floats = np.zeros((0, 2))

    def binding(self, segment: Floats) -> Floats:
        """Return the half-planes that matter to a robot: those that the polygon touches; all, if it is not in that.

        Args:
            segment: (4,) S of the robot (m).

        Returns:
            (b, 3)
        """
        there: Floats = self.half_planes[np.abs(self.half_planes[:, :2]).sum(axis=1) > 0.0]
        x1, y1, x2, y2 = segment.tolist()
        if not (self._holds(complex(x1, y1)) and self._holds(complex(x2, y2))):
            return there
        touched: Floats = there[(self.corners @ there[:, :2].T).max(axis=0) >= there[:, 2] - _TOUCHES_M]
        return touched

    def _holds(self, point: complex) -> bool:
        """Return whether a point, x + iy (m), is in the polygon."""
        corners = self.corners
        return len(corners) > 0 and abs(nearest_in(corners, len(corners), point) - point) <= _TOUCHES_M

    def excess_m(self, segment: Floats) -> float:
        """Return how far a segment (4,), or any part of it, is outside; negative inside."""
        x1, y1, x2, y2 = segment.tolist()
        return float(max(excess_m(self.half_planes, complex(x1, y1)), excess_m(self.half_planes, complex(x2, y2))))

    def nearest(self, point: Floats, otherwise: Floats) -> Floats:
        """Return the point of the roomy part of the cell (m) nearest to another; without such a part, `otherwise`.

        So a robot that has come too near to a wall, by a turn that was not quite on the spot, drives off it again. The
        cell itself would hold it where it is, and let it come nearer bit by bit.
        """
        corners = self.roomy if len(self.roomy) else self.corners
        if not len(corners):
            return otherwise
        found = nearest_in(corners, len(corners), complex(point[0], point[1]))
        return np.array((found.real, found.imag))


def voronoi(points: Floats, area: FreeArea) -> VoronoiParts:
    """Return the Voronoi cells of points in an area, exact for any polygon with obstacles.

    Args:
        points: (n, 2) m, map frame.
        area: The area.

    Raises:
        CoincidentPoints: Two points are the same.
    """
    if len(np.unique(points, axis=0)) < len(points):
        raise CoincidentPoints("two robots are at the same place; move them apart")
    return VoronoiParts(*bisecting(np.ascontiguousarray(points), area.pieces, area.sizes))


def keep_robots_apart(segments: Floats, radius_m: float, rows: Floats, names: Sequence[str]) -> None:
    """Compute the half-planes that keep every two robots apart.

    Args:
        segments: (n, 4) x₁ y₁ x₂ y₂ of each one's stopping segment (m).
        radius_m: r_s.
        rows: (n, n or more, 3) row j of robot i is filled with the half-plane that keeps i from j; row i stays.
        names: Names of the robots, for errors.

    Raises:
        SegmentsMeet: Two segments touch or cross.
    """
    first, second = keep_apart(segments, radius_m, rows)
    if first >= 0:
        raise SegmentsMeet(names[first], names[second])


def within_area(
    segments: Floats, area: FreeArea, radii_m: tuple[float, float], rows: Floats, names: Sequence[str]
) -> list[BufferedCell]:
    """Return cells whose half-planes towards other robots are given.

    Args:
        segments: (n, 4) x₁ y₁ x₂ y₂ of each one's stopping segment (m).
        area: The area.
        radii_m: Distances of a centre from the sides of the area's hull (r_s), and from walls within.
        rows: (n, k + sides and walls of the area, 3) half-planes, of which the first k are given, the rest filled.
        names: Names of the robots.

    Raises:
        SegmentsMeet: A segment touches a wall.
    """
    corners, counts = surrounded(segments, area.hull, area.sides, area.walls, radii_m, rows)
    if len(stuck := np.flatnonzero(counts < 0)):
        raise SegmentsMeet(names[int(stuck[0])], "a wall")
    return [
        BufferedCell(row, some[:count], _roomy(segment, area, radii_m, row, some[:count]))
        for segment, row, some, count in zip(segments, rows, corners, counts, strict=True)
    ]


def _roomy(segment: Floats, area: FreeArea, radii_m: tuple[float, float], row: Floats, corners: Floats) -> Floats:
    """Return (d, 2) the part of a cell that keeps the radii from sides and walls, even if the robot itself does not."""
    walls, sides = row[len(row) - len(area.walls) :], row[len(row) - len(area.walls) - len(area.sides) :]
    offsets = [area.sides[k, OFFSET] - radii_m[0] for k in range(len(area.sides))]
    x1, y1, x2, y2 = segment.tolist()
    for wall, filled in zip(area.walls.tolist(), walls, strict=True):
        apart = apart_squared(complex(x1, y1), complex(x2, y2), complex(*wall[:2]), complex(*wall[2:]))
        offsets.append(filled[OFFSET] - max(radii_m[1] - math.sqrt(apart), 0.0))
    left = corners
    for filled, offset in zip(sides, offsets, strict=True):
        if offset < filled[OFFSET] and filled[:OFFSET].any():
            clipped = np.empty((len(left) + 1, 2))
            kept = clip(left, len(left), np.array([*filled[:OFFSET], offset]), clipped)
            left = clipped[:kept] if kept else left
    return left
