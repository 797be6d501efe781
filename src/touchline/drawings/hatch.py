"""Hatching: parallel strokes, as wide as the nozzle sprays, that fill areas without leaving them."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt

from touchline.core.robust_overlay import buffer, symmetric_difference
from touchline.schemas.template import MIN_LENGTH_M

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

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
    from shapely import Polygon, affinity

    area: BaseGeometry = Polygon()
    for ring in rings:
        area = symmetric_difference(area, buffer(Polygon(ring), 0.0))
    turned = affinity.rotate(area, -angle_rad, origin=(0.0, 0.0), use_radians=True)
    if turned.is_empty:
        return []
    _, low, _, high = turned.bounds
    half = width_m / 2
    if high - low < width_m - 1e-9:
        return []
    count = max(1, math.ceil((high - low) / width_m - 1e-9))
    levels = np.linspace(low + half, high - half, count) if count > 1 else [(low + high) / 2]
    edges = _edges(turned)
    strokes: list[Stroke] = []
    for index, y in enumerate(levels):
        inside: list[tuple[float, float]] | None = None
        # Both edges of the stroke and its middle must be inside; hairline shifts keep off edges along the stroke.
        for edge in (y - half + 1e-6, y, y + half - 1e-6):
            found = _spans(edges, edge)
            inside = found if inside is None else _common(inside, found)
        ends = [((a, float(y)), (b, float(y))) for a, b in inside or [] if b - a >= MIN_LENGTH_M]
        strokes += ends if index % 2 == 0 else [(b, a) for a, b in reversed(ends)]
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    return [
        ((cos * x - sin * y, sin * x + cos * y), (cos * u - sin * v, sin * u + cos * v)) for (x, y), (u, v) in strokes
    ]


def _edges(area: "BaseGeometry") -> npt.NDArray[np.float64]:
    """Edges (n, 4) x₁ y₁ x₂ y₂ of all outlines of an area, m."""
    from shapely import get_coordinates, get_parts, get_rings

    rings = [get_coordinates(ring) for ring in get_rings(get_parts(area))]
    return np.concatenate([np.zeros((0, 4)), *(np.hstack((ring[:-1], ring[1:])) for ring in rings)])


def _spans(edges: npt.NDArray[np.float64], y: float) -> list[tuple[float, float]]:
    """Intervals along x that are inside at a height, ascending, by the even-odd rule.

    Counted, not overlaid: GEOS may return all of a line that crosses an area of almost no width.
    """
    x1, y1, x2, y2 = edges[(edges[:, 1] > y) != (edges[:, 3] > y)].T
    places = np.sort(x1 + (y - y1) / (y2 - y1) * (x2 - x1)).tolist()
    return list(zip(places[::2], places[1::2], strict=True))


def _common(first: list[tuple[float, float]], second: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Intersection of two sets of intervals."""
    common = [(max(a, c), min(b, d)) for a, b in first for c, d in second]
    return [(low, high) for low, high in common if low < high]
