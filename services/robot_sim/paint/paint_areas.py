"""Areas of paint, exact on polygons: paint outside the lines and double paint.

Paint and lines are flat-ended strips about their centre lines. Strokes are simplified and arcs are cut into chords
within `TOLERANCE_M`, so an area has an error of at most that times the length of its edges.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.robust_overlay import buffer, difference, intersection, intersections, union
from touchline.schemas.curves import Curve
from touchline.services.robot_sim.paint.ledger import PaintStroke

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

TOLERANCE_M: Final = 5e-5
_TURN_OF_A_PIECE: Final = 0.9 * math.pi


Points = NDArray[np.float64]


class Areas(NamedTuple):
    """Areas [m²]; see `paint_areas`."""

    wanted_m2: float
    covered_m2: float
    painted_m2: float
    overspray_m2: float
    double_paint_m2: float


class PaintAreas(NamedTuple):
    """Areas of all paint, and of the paint of each line."""

    total: Areas
    lines: list[Areas]


def paint_areas(
    strokes: Sequence[PaintStroke],
    by_line: Sequence[Sequence[PaintStroke]],
    lines: Sequence[Curve],
    line_width_m: float,
) -> PaintAreas:
    """Compute the areas of the paint against the lines.

    `wanted_m2` is the area of the lines' bands, each place counted once; `covered_m2` is the part of it under any
    paint. `painted_m2` is the area of the paint. `overspray_m2` is painted area outside the union of the lines' bands.
    `double_paint_m2` is area under two or more passes of the nozzle, except within half a line width of where two
    lines' bands (lengthened by half a width) cross or join, since there the template itself requires it.

    Args:
        strokes: All paint.
        by_line: Per line, the stretches of strokes that belong to it.
        lines: Lines to be painted.
        line_width_m: Width of the lines.
    """
    bands = [band_of(line, line_width_m) for line in lines]
    intended = union(bands)
    joints = _joints(lines, line_width_m)

    def measure(passes: Sequence[BaseGeometry]) -> tuple[float, float, float]:
        """Return the areas painted, beside the lines, and painted twice."""
        if not passes:
            return 0.0, 0.0, 0.0
        painted = union(passes)
        overspray = difference(painted, intended)
        twice = difference(overlaps(passes), joints)
        return float(painted.area), float(overspray.area), float(twice.area)

    passes = passes_of(strokes)
    painted_m2, overspray_m2, twice_m2 = measure(passes)
    total = Areas(float(intended.area), max(0.0, painted_m2 - overspray_m2), painted_m2, overspray_m2, twice_m2)
    each = [
        Areas(float(band.area), covered_m2, *measure(passes_of(stretches)))
        for band, covered_m2, stretches in zip(bands, _covered(bands, passes), by_line, strict=True)
    ]
    return PaintAreas(total, each)


def passes_of(strokes: Sequence[PaintStroke]) -> list[BaseGeometry]:
    """Return the strips of strokes, cut so that none overlaps itself."""
    return [strip(simplified(piece), stroke.width_m) for stroke in strokes for piece in pieces_of(stroke.points)]


def _covered(bands: Sequence[BaseGeometry], passes: Sequence[BaseGeometry]) -> list[float]:
    """Return per band the area [m²] under any pass."""
    import shapely

    parts: list[list[BaseGeometry]] = [[] for _ in bands]
    if bands and passes:
        index, hit = shapely.STRtree(passes).query(bands, predicate="intersects")
        shared = intersections(np.array(bands, dtype=object)[index], np.array(passes, dtype=object)[hit])
        for band, part in zip(index.tolist(), shared, strict=True):
            parts[band].append(part)
    return [float(union(part).area) for part in parts]


def band_of(line: Curve, width_m: float) -> BaseGeometry:
    """Return the flat-ended band of a line.

    Args:
        line: The line or arc.
        width_m: Width of the band.
    """
    return strip(polyline_of(line), width_m)


def strip(points: Points, width_m: float, cap_style: Literal["flat", "square"] = "flat") -> BaseGeometry:
    """Return the band about a polyline.

    Args:
        points: (n, 2) points of the polyline [m].
        width_m: Width of the band.
        cap_style: Form of its ends.
    """
    import shapely

    line = shapely.LineString(points)
    return buffer(line, 0.5 * width_m, cap_style=cap_style, join_style="mitre", mitre_limit=2.0)


def simplified(points: Points, tolerance_m: float = TOLERANCE_M) -> Points:
    """Simplify a polyline.

    Args:
        points: (n, 2) points [m].
        tolerance_m: Largest distance between the two.

    Returns:
        (m, 2) fewer points.
    """
    import shapely

    return np.asarray(shapely.LineString(points).simplify(tolerance_m, preserve_topology=False).coords)


def polyline_of(curve: Curve) -> NDArray[np.float64]:
    """Return (n, 2) points on a curve, with chords within the tolerance of it."""
    pieces = 1
    if curve.curvature_1pm != 0.0:
        radius = 1.0 / abs(curve.curvature_1pm)
        pieces = math.ceil(curve.length_m / math.sqrt(8.0 * radius * min(TOLERANCE_M, radius)))
    x, y, _, _ = curve.at(np.linspace(0.0, curve.length_m, max(1, pieces) + 1))
    return np.column_stack((x, y))


def pieces_of(points: Points) -> list[Points]:
    """Cut a stroke (n, 2) where it turns back or has turned by half a circle, so that no piece overlaps itself."""
    moved = np.concatenate(([True], np.any(np.diff(points, axis=0) != 0.0, axis=1)))
    points = points[moved]
    if len(points) < 2:
        return []
    headings = np.arctan2(np.diff(points[:, 1]), np.diff(points[:, 0]))
    turns = (np.diff(headings) + np.pi) % (2.0 * np.pi) - np.pi
    back = np.abs(turns) > 0.5 * math.pi
    pieces: list[NDArray[np.float64]] = []
    first = 0
    while first < len(points) - 1:
        over = back[first:] | (np.abs(np.cumsum(turns[first:])) > _TURN_OF_A_PIECE)
        last = first + int(np.argmax(over)) + 1 if over.any() else len(points) - 1
        pieces.append(points[first : last + 1])
        first = last
    return pieces


def overlaps(strips: Sequence[BaseGeometry], apart: Callable[[int, int], bool] | None = None) -> BaseGeometry:
    """Return the union of the pairwise intersections of strips.

    Args:
        strips: The strips.
        apart: Called with the indices `i` < `j` of a pair; False leaves the pair out.
    """
    import shapely

    if not strips:
        return shapely.MultiPolygon()
    left, right = shapely.STRtree(strips).query(strips, predicate="intersects")
    pairs = [(i, j) for i, j in zip(left.tolist(), right.tolist(), strict=True) if i < j]
    shared = [intersection(strips[i], strips[j]) for i, j in sorted(pairs) if apart is None or apart(i, j)]
    return union(shared)


def _joints(lines: Sequence[Curve], line_width_m: float) -> BaseGeometry:
    """Return the joints of lines, a circle's own ends included: overlaps of bands, grown by half a line width."""
    parts = [(index, third, curve) for index, line in enumerate(lines) for third, curve in enumerate(_thirds(line))]
    strips = [strip(polyline_of(curve), line_width_m, "square") for _, _, curve in parts]

    def apart(i: int, j: int) -> bool:
        return parts[i][0] != parts[j][0] or abs(parts[i][1] - parts[j][1]) > 1

    return buffer(overlaps(strips, apart), 0.5 * line_width_m)


def _thirds(line: Curve) -> list[Curve]:
    """Cut an arc of more than half a circle in three, so that its first and last part can be seen to join."""
    if abs(line.curvature_1pm) * line.length_m <= math.pi:
        return [line]
    third = line.length_m / 3.0
    starts = [[float(value) for value in line.at(index * third)] for index in range(3)]
    return [Curve(x, y, heading, line.curvature_1pm, third) for x, y, heading, _ in starts]
