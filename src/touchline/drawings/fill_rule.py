"""Inside of rings that may cross themselves and each other, by a fill rule."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from touchline.drawings.outline import FillRule, Floats

if TYPE_CHECKING:
    from shapely import Point, Polygon

#: Grid of corners, m, so that crossing and touching do not depend on the position.
GRID_M = 1e-6


def enclosed(rings: Sequence[Floats], rule: FillRule) -> "list[Polygon]":
    """Polygons, with holes, that rings (n, 2) enclose; an empty list if they enclose nothing."""
    import shapely

    sides = [shapely.LineString(np.vstack((ring, ring[:1]))) for ring in rings if len(ring) > 2]
    edges = shapely.get_parts(shapely.union_all(sides, grid_size=GRID_M))
    faces = shapely.get_parts(shapely.polygonize(edges.tolist()))
    kept = [face for face in faces if _inside(face.representative_point(), rings, rule)]
    parts = shapely.get_parts(shapely.union_all(kept, grid_size=GRID_M))
    return [part for part in parts if part.geom_type == "Polygon" and not part.is_empty]


def _inside(point: "Point", rings: Sequence[Floats], rule: FillRule) -> bool:
    at = np.array((point.x, point.y))
    times = sum(_times_round(ring - at) for ring in rings)
    return times % 2 == 1 if rule is FillRule.EVEN_ODD else times != 0


def _times_round(ring: Floats) -> int:
    """Winding number of a ring about the origin, counter-clockwise positive."""
    (x0, y0), (x1, y1) = ring.T, np.roll(ring, -1, axis=0).T
    left = x0 * y1 - x1 * y0
    up, down = (y0 <= 0) & (y1 > 0) & (left > 0), (y0 > 0) & (y1 <= 0) & (left < 0)
    return int(up.sum()) - int(down.sum())
