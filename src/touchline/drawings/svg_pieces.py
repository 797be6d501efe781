"""SVG subpaths in metres: circles stay circles, and pieces of no length are dropped."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from touchline.drawings.deviation import sampled
from touchline.drawings.outline import Floats, Outline, Piece, bezier, ellipse
from touchline.drawings.path_data import Drawn, EllipseArc, SubPath
from touchline.schemas.curves import Curve

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

#: Relative difference up to which an ellipse is a circle.
ROUND = 1e-9
#: Maximum coordinate, m.
MOST_M = 1e9


def parallelogram(matrix: Floats, corners: Floats) -> "BaseGeometry":
    """Polygon of corners (n, 2) in user units, m."""
    import shapely

    return shapely.Polygon(carried(matrix, corners))


def carried(matrix: Floats, points: Floats) -> Floats:
    """Transform points (n, 2) or (2,) by a matrix (3, 3)."""
    return np.asarray(points @ matrix[:2, :2].T + matrix[:2, 2] + 0.0)


def metric_pieces(drawn: Drawn, matrix: Floats) -> Iterator[Piece]:
    """Convert a piece to metres; nothing, if it has no length."""
    if isinstance(drawn, EllipseArc):
        linear = matrix[:2, :2]
        yield _arc(carried(matrix, drawn.center), linear @ drawn.first, linear @ drawn.second, drawn)
        return
    points = carried(matrix, drawn)
    if (points == points[0]).all():
        return
    if len(points) > 2:
        yield bezier(points)
    else:
        (x1, y1), (x2, y2) = points.tolist()
        yield Curve.from_line((x1, y1), (x2, y2))


def _arc(center: Floats, p: Floats, q: Floats, drawn: EllipseArc) -> Piece:
    """Elliptical arc, or the exact circular one if both half-diameters are equal and perpendicular."""
    size = float(p @ p)
    if abs(size - float(q @ q)) <= ROUND * size and abs(float(p @ q)) <= ROUND * size:
        turn = math.copysign(1.0, float(p[0] * q[1] - p[1] * q[0]))
        x, y = (center + math.cos(drawn.begin) * p + math.sin(drawn.begin) * q).tolist()
        return Curve.from_arc((x, y), (float(center[0]), float(center[1])), turn * (drawn.end - drawn.begin))
    return ellipse(center, p, q, drawn.begin, drawn.end)


def is_within_reach(piece: Piece) -> bool:
    """True if all coordinates of a piece are finite and at most `MOST_M`."""
    points = sampled(piece, 5)
    return bool(np.isfinite(points).all() and np.abs(points).max() <= MOST_M)


def is_point(sub: SubPath) -> bool:
    """True if a subpath has no length."""
    return all(not isinstance(drawn, EllipseArc) and bool((drawn == drawn[0]).all()) for drawn in sub.pieces)


def is_flat(subpaths: Sequence[SubPath]) -> bool:
    """True if the subpaths together have no width or no height."""
    drawn = [piece for sub in subpaths for piece in sub.pieces]
    if any(isinstance(piece, EllipseArc) for piece in drawn):
        return False
    return not drawn or bool(
        (np.ptp(np.concatenate([p for p in drawn if not isinstance(p, EllipseArc)]), axis=0) == 0.0).any()
    )


def closed_as_filled(outline: Outline) -> Outline:
    """Close an outline, as a fill does, by a straight line back to its beginning."""
    if outline.closed:
        return outline
    start, end = sampled(outline.pieces[0], 2)[0].tolist(), sampled(outline.pieces[-1], 2)[-1].tolist()
    back = () if start == end else (Curve.from_line((end[0], end[1]), (start[0], start[1])),)
    return replace(outline, pieces=outline.pieces + back, closed=True)
