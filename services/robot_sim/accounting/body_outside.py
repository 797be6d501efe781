"""How far the body got where it must not be."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.template import Template
from touchline.services.robot_sim.paint.track import TRACK_EAST, TRACK_HEADING, TRACK_NORTH

if TYPE_CHECKING:
    from collections.abc import Sequence

    import shapely

_SPACING_M: Final = 0.05
"""Of the points of the body that are looked at where it is in forbidden ground."""
_AT_ONCE: Final = 20_000
"""Poses."""

Floats = NDArray[np.float64]


def body_outside_m(rows: Floats, outline: Sequence[tuple[float, float]], template: Template) -> float:
    """How far any part of the body was beyond the boundary or inside an obstacle, at most [m].

    Args:
        rows: (n, TRACK_COLUMNS) of the `Track`.
        outline: Of the body.
        template: Has the boundary, if there is one, and the obstacles.
    """
    import shapely

    ways_out = [shapely.Polygon(template.boundary.corners)] if template.boundary is not None else []
    obstacles = [shapely.Polygon(obstacle.corners) for obstacle in template.obstacles]
    depth_m = 0.0
    for first in range(0, len(rows), _AT_ONCE):
        bodies = _bodies(rows[first : first + _AT_ONCE], outline)
        for boundary in ways_out:
            shapely.prepare(boundary)
            strays = bodies[~shapely.covers(boundary, bodies)]
            depth_m = max(depth_m, _farthest_m(shapely.difference(strays, boundary), boundary))
        for obstacle in obstacles:
            shapely.prepare(obstacle)
            hits = bodies[shapely.intersects(obstacle, bodies)]
            depth_m = max(depth_m, _farthest_m(shapely.intersection(hits, obstacle), obstacle.exterior))
    return depth_m


def _bodies(rows: Floats, outline: Sequence[tuple[float, float]]) -> NDArray[np.object_]:
    import shapely

    x, y = np.array([*outline, outline[0]]).T
    cos, sin = np.cos(rows[:, TRACK_HEADING, None]), np.sin(rows[:, TRACK_HEADING, None])
    east = rows[:, TRACK_EAST, None] + cos * x - sin * y
    north = rows[:, TRACK_NORTH, None] + sin * x + cos * y
    return np.atleast_1d(np.asarray(shapely.polygons(np.stack((east, north), axis=-1)), dtype=object))


def _farthest_m(parts: NDArray[np.object_], limit: shapely.Polygon | shapely.LinearRing) -> float:
    """How far the farthest point of some parts is from where it should have ended."""
    import shapely

    points = shapely.get_coordinates(shapely.segmentize(parts, _SPACING_M))
    return float(shapely.distance(shapely.points(points), limit).max()) if len(points) else 0.0
