"""Hatching: parallel strokes, as wide as the nozzle sprays, that fill areas without leaving them."""

import math
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from touchline.core.robust_overlay import buffer, intersection, symmetric_difference
from touchline.schemas.template import MIN_LENGTH_M

Ring: TypeAlias = npt.NDArray[np.float64]
Stroke: TypeAlias = tuple[tuple[float, float], tuple[float, float]]


def hatch(rings: Sequence[Ring], width_m: float, angle_rad: float = 0.0) -> list[Stroke]:
    """Cover an area with strokes back and forth.

    The strokes lie at most ``width_m`` apart (they overlap where the area is not a whole number of widths), the outer
    ones half a width inside the edge. Ends are cut where the stroke's whole width is inside, so that a slanted edge is
    stepped but never crossed.

    Args:
        rings: Closed outlines, (n, 2) m each; a ring inside another is a hole, one inside that is filled again.
        width_m: Width of a stroke.
        angle_rad: Direction of the strokes.

    Returns:
        Start and end points, m; empty if the area is everywhere narrower than a stroke.
    """
    from shapely import LineString, Polygon, affinity
    from shapely.geometry.base import BaseGeometry

    area: BaseGeometry = Polygon()
    for ring in rings:
        area = symmetric_difference(area, buffer(Polygon(ring), 0.0))
    turned = affinity.rotate(area, -angle_rad, origin=(0.0, 0.0), use_radians=True)
    if turned.is_empty:
        return []
    left, low, right, high = turned.bounds
    half = width_m / 2
    if high - low < width_m - 1e-9:
        return []
    count = max(1, math.ceil((high - low) / width_m - 1e-9))
    levels = np.linspace(low + half, high - half, count) if count > 1 else [(low + high) / 2]
    strokes: list[Stroke] = []
    for index, y in enumerate(levels):
        inside: list[tuple[float, float]] | None = None
        # Both edges of the stroke and its middle must be inside; hairline shifts keep off edges along the stroke.
        for edge in (y - half + 1e-6, y, y + half - 1e-6):
            line = LineString([(left - 1.0, edge), (right + 1.0, edge)])
            found = _spans(intersection(line, turned))
            inside = found if inside is None else _common(inside, found)
        ends = [((a, float(y)), (b, float(y))) for a, b in inside or [] if b - a >= MIN_LENGTH_M]
        strokes += ends if index % 2 == 0 else [(b, a) for a, b in reversed(ends)]
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    return [
        ((cos * x - sin * y, sin * x + cos * y), (cos * u - sin * v, sin * u + cos * v)) for (x, y), (u, v) in strokes
    ]


def _spans(found: object) -> list[tuple[float, float]]:
    """Intervals along x of an intersection with a horizontal line, ascending."""
    parts = getattr(found, "geoms", [found])
    bounds = [part.bounds for part in parts if getattr(part, "length", 0.0) > 0.0]
    return sorted((b[0], b[2]) for b in bounds)


def _common(first: list[tuple[float, float]], second: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Intersection of two sets of intervals."""
    common = [(max(a, c), min(b, d)) for a, b in first for c, d in second]
    return [(low, high) for low, high in common if low < high]
