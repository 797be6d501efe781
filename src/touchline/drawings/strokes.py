"""Strokes of an outline: its lines, one line in place of two that nearly coincide, a dot, or nothing."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise

import numpy as np

from touchline.core.plain_sum import plain_sum
from touchline.drawings.arc_columns import COINCIDENT_M
from touchline.drawings.detail import Detail
from touchline.drawings.deviation import distance_m, sampled
from touchline.drawings.fit import fit_outline
from touchline.drawings.outline import Floats, Outline
from touchline.drawings.refit import refit
from touchline.drawings.slivers import without_slivers
from touchline.schemas.curves import Curve

#: Tolerance of the first fit of smooth curves, as a fraction of that of the refit.
FINE_SHARE = 0.1
#: A drawn arc with a smaller sagitta, m, and a larger radius, m, is a line.
FLAT_M, FLAT_RADIUS_M = 1e-3, 2_000.0
#: Minimum samples for the size of an outline; spacing on long ones, as a fraction of the detail; maximum samples.
POINTS, POINTS_SHARE, MOST_POINTS = 65, 0.5, 2_000


class StrokeKind(Enum):
    """Treatment of an outline."""

    LINES = "lines"
    DOT = "dot"
    DOUBLED = "doubled line"
    SPECK = "speck"


@dataclass(frozen=True)
class Strokes:
    """Outline as painted.

    Attributes:
        kind: Treatment of the outline.
        drawn: Lines and arcs that approximate the drawing, well within the tolerance.
        curves: Painted lines and arcs; a speck has none.
    """

    kind: StrokeKind
    drawn: list[Curve]
    curves: list[Curve]

    @classmethod
    def of(cls, outline: Outline, detail: Detail) -> "Strokes":
        """Compute the strokes of an outline; without a smallest feature, all that a template may hold is kept."""
        fine = FINE_SHARE * detail.tolerance_m if detail.feature_m else detail.tolerance_m
        exact = {_flattened(piece) for piece in outline.pieces if isinstance(piece, Curve)}
        drawn = [_flattened(curve) for curve in fit_outline(outline, fine)]
        if not drawn:
            return cls(StrokeKind.SPECK, [], [])
        kind, curves = StrokeKind.LINES, drawn
        if detail.feature_m:
            kind, curves = _reduced(drawn, [curve in exact for curve in drawn], outline.closed, detail)
        curves = without_slivers(curves) if curves else []
        return cls(kind if curves else StrokeKind.SPECK, drawn, curves)


def _flattened(curve: Curve) -> Curve:
    bend = abs(curve.curvature_1pm)
    if bend == 0.0 or bend * FLAT_RADIUS_M >= 1.0 or bend * curve.length_m**2 / 8 > FLAT_M:
        return curve
    return Curve.from_line((curve.x_m, curve.y_m), curve.end[:2])


def _reduced(drawn: list[Curve], exact: Sequence[bool], closed: bool, detail: Detail) -> tuple[StrokeKind, list[Curve]]:
    start, end = (drawn[0].x_m, drawn[0].y_m), drawn[-1].end[:2]
    length = plain_sum(curve.length_m for curve in drawn)
    if length <= 4 * detail.feature_m:
        points = _points(drawn, POINTS)
        axis = _axis(points)
        size = float(np.ptp(points @ axis))
        if size < detail.stray_m:
            return StrokeKind.SPECK, []
        if size < detail.feature_m:
            return StrokeKind.DOT, [drawn[0]] if len(drawn) == 1 and size >= detail.feature_m / 2 else _dot(
                points, axis, detail
            )
    gap = float(np.hypot(end[0] - start[0], end[1] - start[1]))
    if not closed and length > 4 * detail.feature_m and gap <= detail.stray_m:
        closed = True  # the painted line shows no such gap
        if gap > COINCIDENT_M:
            drawn, exact = [*drawn, Curve.from_line(end, start)], [*exact, False]
    if closed:
        middle = _middle_line(drawn, length, detail)
        if middle:
            return StrokeKind.DOUBLED, refit(middle, [False] * len(middle), False, detail)
    return StrokeKind.LINES, refit(drawn, exact, closed, detail)


def _dot(points: Floats, axis: Floats, detail: Detail) -> list[Curve]:
    """Short line along the longer side of an outline that is too small for its own lines."""
    low, high = float((points @ axis).min()), float((points @ axis).max())
    across = np.array([-axis[1], axis[0]])
    side = points @ across
    middle = (low + high) / 2 * axis + (float(side.min()) + float(side.max())) / 2 * across
    half = max(high - low, detail.feature_m / 2) / 2 * axis
    (x, y), (u, v) = (middle - half).tolist(), (middle + half).tolist()
    return [Curve.from_line((x, y), (u, v))]


def _axis(points: Floats) -> Floats:
    """Direction of the largest extent of points (n, 2); x if they are round."""
    centred = points - points.mean(axis=0)
    (a, b), (_, c) = centred.T @ centred
    if np.hypot(a - c, 2 * b) <= 1e-3 * (a + c):
        return np.array([1.0, 0.0])
    angle = np.arctan2(2 * b, a - c) / 2
    return np.array([np.cos(angle), np.sin(angle)])


def _middle_line(drawn: list[Curve], length_m: float, detail: Detail) -> list[Curve]:
    """Middle line of a closed outline that returns along nearly the same path; empty if it does not."""
    count = min(max(POINTS, int(length_m / (POINTS_SHARE * detail.feature_m))), MOST_POINTS)
    points = _points(drawn, count)[:-1]
    # The point farthest from any point is a tip of such a line, and the one farthest from that the other tip.
    first = int(np.argmax(np.hypot(*(points - points[0]).T)))
    points = np.roll(points, -first, axis=0)
    second = int(np.argmax(np.hypot(*(points - points[0]).T)))
    there, back = points[: second + 1], np.vstack((points[second:], points[:1]))[::-1]
    if min(len(there), len(back)) < 3:
        return []
    sides = [_polyline(there), _polyline(back)]
    if max(distance_m(back, sides[0]).max(), distance_m(there, sides[1]).max()) > detail.stray_m:
        return []
    dense = _points(sides[1], 8 * count)
    from scipy.spatial import cKDTree

    _, nearest = cKDTree(dense).query(there)
    middle = (there + dense[nearest]) / 2
    tips = there[[0, -1]]
    inner = middle[np.hypot(*(middle[:, None] - tips).T).min(axis=0) > detail.feature_m]
    if len(inner) < 2:
        return _polyline(tips)
    # Near a tip the nearest points of both sides are on the short side: the line continues straight.
    ends = [_straight_on(inner[1], inner[0], tips[0]), _straight_on(inner[-2], inner[-1], tips[1])]
    return _polyline(np.vstack((ends[0], inner, ends[1])))


def _straight_on(before: Floats, here: Floats, tip: Floats) -> Floats:
    """Point of the line from ``before`` to ``here`` that is nearest to ``tip``."""
    along = (here - before) / np.hypot(*(here - before))
    return np.asarray(here + float((tip - here) @ along) * along)


def _polyline(points: Floats) -> list[Curve]:
    ends = [(x, y) for x, y in points.tolist()]
    return [Curve.from_line(a, b) for a, b in pairwise(ends) if a != b]


def _points(curves: Sequence[Curve], count: int) -> Floats:
    """Roughly equidistant points (count or more, 2) along connected curves, joints included."""
    length = plain_sum(curve.length_m for curve in curves)
    parts = [sampled(curve, max(2, int(np.ceil(count * curve.length_m / length)) + 1)) for curve in curves]
    return np.concatenate([parts[0], *(part[1:] for part in parts[1:])])
