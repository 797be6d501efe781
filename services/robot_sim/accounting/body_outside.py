"""Distance that the body reached into forbidden ground."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.robust_overlay import buffer, differences, intersections
from touchline.schemas.template import Template
from touchline.services.robot_sim.paint.track import TRACK_EAST, TRACK_HEADING, TRACK_NORTH

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    import shapely
    from shapely.geometry.base import BaseGeometry

_SPACING_M: Final = 0.05
"""Spacing of the points of the body that are checked in forbidden ground."""
_AT_ONCE: Final = 20_000
"""Number of poses handled at once."""
_ARCS: Final = 1.01
"""Factor by which ground is widened further, so that chords reach as far as the arcs that they replace."""

Floats = NDArray[np.float64]


def body_outside_m(rows: Floats, outline: Sequence[tuple[float, float]], template: Template) -> float:
    """Compute the largest distance of any part of the body beyond the boundary or inside an obstacle [m].

    Args:
        rows: (n, TRACK_COLUMNS) of the `Track`.
        outline: Corners of the body in its own frame [m].
        template: Gives the boundary, if there is one, and the obstacles.
    """
    import shapely

    ways_out = [shapely.Polygon(template.boundary.corners)] if template.boundary is not None else []
    obstacles = [shapely.Polygon(obstacle.corners) for obstacle in template.obstacles]
    reach_m, depth_m = _ARCS * max(math.hypot(*corner) for corner in outline), 0.0
    for boundary in ways_out:
        shapely.prepare(boundary)
        near = rows[~_inside(buffer(boundary, -reach_m), rows)]
        for bodies in _bodies(near, outline):
            strays = bodies[~shapely.covers(boundary, bodies)]
            depth_m = max(depth_m, _farthest_m(differences(strays, boundary), boundary))
    for obstacle in obstacles:
        shapely.prepare(obstacle)
        near = rows[_inside(buffer(obstacle, reach_m), rows)]
        for bodies in _bodies(near, outline):
            hits = bodies[shapely.intersects(obstacle, bodies)]
            depth_m = max(depth_m, _farthest_m(intersections(hits, obstacle), obstacle.exterior))
    return depth_m


def _inside(ground: BaseGeometry, rows: Floats) -> NDArray[np.bool_]:
    """Find the rows (n,) in which the body's origin is inside some ground."""
    import shapely

    shapely.prepare(ground)
    return np.asarray(shapely.contains_xy(ground, rows[:, TRACK_EAST], rows[:, TRACK_NORTH]))


def _bodies(rows: Floats, outline: Sequence[tuple[float, float]]) -> Iterator[NDArray[np.object_]]:
    """Yield the body in each row as a polygon, in batches."""
    import shapely

    x, y = np.array([*outline, outline[0]]).T
    for first in range(0, len(rows), _AT_ONCE):
        at = rows[first : first + _AT_ONCE, :, None]
        cos, sin = np.cos(at[:, TRACK_HEADING]), np.sin(at[:, TRACK_HEADING])
        east = at[:, TRACK_EAST] + cos * x - sin * y
        north = at[:, TRACK_NORTH] + sin * x + cos * y
        corners = np.stack((east, north), axis=-1)
        yield np.asarray(shapely.polygons(corners), dtype=object)


def _farthest_m(parts: NDArray[np.object_], limit: shapely.Polygon | shapely.LinearRing) -> float:
    """Return the largest distance of the points of some parts from the edge of the permitted ground."""
    import shapely

    points = shapely.get_coordinates(shapely.segmentize(parts, _SPACING_M))
    return float(shapely.distance(shapely.points(points), limit).max()) if len(points) else 0.0
