"""Division of polygons into convex ones, and the convex parts of a vehicle's body."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from touchline.core.robust_overlay import as_area, buffer
from touchline.services.planner.geometry.clothoid import Floats

# Distance from a corner of the body at which its margin is cut off, as a multiple of the margin.
CUT_OFF = 1.03
# A corner of a convex part may be this much (m², twice the area of a triangle) on the wrong side, by rounding.
ROUNDING_M2 = 1e-12

Corner = tuple[float, float]


def convex_parts(shape: shapely.Polygon | shapely.MultiPolygon) -> list[Floats]:
    """Divide a shape into convex polygons that cover it exactly.

    Triangles are merged while they stay convex: Hertel and Mehlhorn, "Fast triangulation of simple polygons", FCT 1983.

    Args:
        shape: Polygons, with or without holes (m).

    Returns:
        (n, 2) corners of each part, counter-clockwise (m).
    """
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(shape))
    rings = {k: _counter_clockwise(shapely.get_coordinates(each)[:3]) for k, each in enumerate(triangles)}
    owner = {edge: k for k, ring in rings.items() for edge in _edges(ring)}
    for a, b in list(owner):
        first, second = owner[a, b], owner.get((b, a), -1)
        if second < 0 or first == second:
            continue
        merged = _merged(rings[first], rings[second], a, b)
        if merged:
            rings[first] = merged
            owner.update(dict.fromkeys(_edges(rings.pop(second)), first))
    return [np.array(ring) for ring in rings.values()]


def body_parts(outline: Sequence[Corner], margin_m: float) -> list[Floats]:
    """Convex parts of a body with a margin all round; of one that is reduced to nothing, none.

    Its corners are cut off, so that things are kept hardly farther off them than off the sides.

    Args:
        outline: (n, 2) corners of the body, in its own frame (m).
        margin_m: Margin (m); negative: the body is reduced on every side.
    """
    shape = as_area(buffer(shapely.Polygon(outline), margin_m, join_style="mitre", mitre_limit=CUT_OFF))
    return [] if shape.is_empty else convex_parts(shape)


def _merged(first: list[Corner], second: list[Corner], a: Corner, b: Corner) -> list[Corner]:
    """Join two convex rings at their common edge a-b; empty if the result is not convex."""
    i, j = first.index(b), second.index(a)
    ring = first[i:] + first[:i] + (second[j:] + second[:j])[1:-1]  # from b round to a, and back to b
    seam = ring.index(a)
    convex = _turn(ring, 0) >= -ROUNDING_M2 and _turn(ring, seam) >= -ROUNDING_M2
    return ring if convex else []


def _turn(ring: list[Corner], k: int) -> float:
    """Twice the signed area of the triangle at a corner."""
    (ax, ay), (bx, by), (cx, cy) = ring[k - 1], ring[k], ring[(k + 1) % len(ring)]
    return (bx - ax) * (cy - by) - (by - ay) * (cx - bx)


def _edges(ring: list[Corner]) -> list[tuple[Corner, Corner]]:
    return list(zip(ring, ring[1:] + ring[:1], strict=True))


def _counter_clockwise(corners: Floats) -> list[Corner]:
    ring = [(float(x), float(y)) for x, y in corners]
    return ring if _turn(ring, 1) > 0.0 else ring[::-1]
