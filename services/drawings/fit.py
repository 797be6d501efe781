"""Smooth curves as lines and arcs, which is all that the robot drives: biarcs, with the curve's own tangents.

A biarc is two arcs that leave the curve's first point with its tangent, arrive at its last with its tangent, and meet
with a common one (Bolton 1975, here with equal legs). Where it strays further than the tolerance the span is halved.
"""

from collections.abc import Iterable, Sequence

import numpy as np

from schemas.curves import Curve
from services.drawings.outline import Floats, Outline, Piece, Smooth
from services.drawings.slivers import without_slivers

#: How far the fit may be from the curve, and the share of it that spans may use up between the samples looked at.
TOLERANCE_M, SHARE = 1e-3, 0.9
SAMPLES, STEEPEST_RAD, DEPTH = 24, np.pi / 2, 24
#: Spacing of the points of a line or an arc by which the fit is told, unless they are too many.
SAMPLES_M = 2e-4
#: A turn below this over a whole piece is a straight line to every computer on board.
STRAIGHT_RAD, COINCIDENT_M = 1e-9, 1e-11
#: Share of a span whose chord stands in for a tangent that vanishes.
CHORD_SHARE = 1e-4


def fit_outline(outline: Outline, tolerance_m: float = TOLERANCE_M) -> list[Curve]:
    """The lines and arcs of an outline, each of which a template may hold.

    What is shorter or tighter than that is bridged by straight lines. They stray by up to half of a template's shortest
    line, 5 mm, from the lines and arcs, which are within ``tolerance_m`` of the outline; :func:`deviation_m` tells.
    Empty if all of the outline is as near to where it begins.
    """
    curves: list[Curve] = []
    for piece in outline.pieces:
        curves += [piece] if isinstance(piece, Curve) else fit(piece, tolerance_m)
    return without_slivers([curve for curve in curves if curve.length_m > COINCIDENT_M])


def fit(smooth: Smooth, tolerance_m: float = TOLERANCE_M) -> list[Curve]:
    """Lines and arcs within ``tolerance_m`` of a smooth curve; headings are continuous where the curve's are."""
    curves: list[Curve] = []
    for begin, end in zip(smooth.breaks, smooth.breaks[1:], strict=False):
        curves += _span(smooth, begin, end, tolerance_m * SHARE, DEPTH)
    return curves


def deviation_m(outline: Outline, curves: Sequence[Curve], samples: int = 200) -> float:
    """How far an outline's points are from ``curves`` at most, m; at most ``samples`` of each piece are looked at."""
    kept = set(curves)
    points = [_samples(piece, samples) for piece in outline.pieces if piece not in kept]
    return float(distance_m(np.concatenate(points), curves).max()) if points else 0.0


def distance_m(points: Floats, curves: Iterable[Curve]) -> Floats:
    """Distance (n,) of points (n, 2) to the nearest of ``curves``, m."""
    nearest = np.full(len(points), np.inf)
    for curve in curves:
        nearest = np.minimum(nearest, _to_curve(points, curve))
    return nearest


def _samples(piece: Piece, most: int) -> Floats:
    """Points (n, 2) of a piece of an outline, m."""
    if isinstance(piece, Smooth):
        return piece.point(np.linspace(piece.breaks[0], piece.breaks[-1], most))
    count = min(most, int(piece.length_m / SAMPLES_M) + 2)
    return np.column_stack(piece.at(np.linspace(0.0, piece.length_m, count))[:2])


def _span(smooth: Smooth, begin: float, end: float, tolerance_m: float, depth: int) -> list[Curve]:
    t = np.linspace(begin, end, SAMPLES)
    points = smooth.point(t)
    if float(np.hypot(*(points - points[0]).T).max()) < COINCIDENT_M:
        return []
    curves = _biarc(points[0], _tangent(smooth, begin, end), points[-1], -_tangent(smooth, end, begin))
    fits = bool(curves) and float(distance_m(points, curves).max()) <= tolerance_m
    if fits and all(abs(c.curvature_1pm) * c.length_m <= STEEPEST_RAD for c in curves):
        return curves
    if depth == 0:
        return [Curve.from_line(_pair(points[0]), _pair(points[-1]))]
    middle = (begin + end) / 2
    first = _span(smooth, begin, middle, tolerance_m, depth - 1)
    return first + _span(smooth, middle, end, tolerance_m, depth - 1)


def _tangent(smooth: Smooth, at: float, towards: float) -> Floats:
    """Unit vector in which the curve leaves ``at`` in the direction of ``towards``, also where it stands still."""
    step = (towards - at) * CHORD_SHARE
    near, nearer, here = smooth.point(np.array([at + step, at + step / 2, at]))
    chord = near - here
    slope = smooth.derivative(np.array([at]))[0] * step
    if float(np.hypot(*slope)) < 0.5 * float(np.hypot(*chord)):
        # A cusp or a handle of no length: the chords' directions, extrapolated to a chord of no length.
        slope = 2.0 * _unit(nearer - here) - _unit(chord)
    return _unit(slope)


def _unit(vector: Floats) -> Floats:
    size = float(np.hypot(*vector))
    return np.asarray(vector / size) if size > 0.0 else np.array([1.0, 0.0])


def _biarc(start: Floats, leave: Floats, end: Floats, arrive: Floats) -> list[Curve]:
    """Two arcs, or one line; empty if there is none that goes forward.

    With legs of equal length d: |v|² − 2d v·(t₀ + t₁) − 2d²(1 − t₀·t₁) = 0, where v joins the ends.
    """
    v, both = end - start, leave + arrive
    if float(np.hypot(*v)) < COINCIDENT_M:
        return []
    a, b, c = 2.0 * (1.0 - float(leave @ arrive)), 2.0 * float(v @ both), -float(v @ v)
    root = np.sqrt(b * b - 4.0 * a * c)
    if b + root <= 0.0:
        return []
    leg = -2.0 * c / (b + root)
    joint = (start + end + leg * (leave - arrive)) / 2.0
    first, second = _arc(start, leave, joint), _arc(end, -arrive, joint)
    if first is None or second is None:
        return []
    if max(abs(each.curvature_1pm) * each.length_m for each in (first, second)) < STRAIGHT_RAD:
        return [Curve.from_line(_pair(start), _pair(end))]
    return [first, second.reversed()]


def _arc(start: Floats, leave: Floats, end: Floats) -> Curve | None:
    """The arc that leaves ``start`` along ``leave`` and passes ``end``; None if they are one point or it is behind."""
    chord = end - start
    reach = float(np.hypot(*chord))
    if reach < COINCIDENT_M:
        return None
    across, along = float(leave[0] * chord[1] - leave[1] * chord[0]), float(leave @ chord)
    half_turn = float(np.arctan2(across, along))
    if abs(half_turn) > STEEPEST_RAD:
        return None
    heading = float(np.arctan2(leave[1], leave[0]))
    if 2 * abs(half_turn) < STRAIGHT_RAD:
        return Curve.from_line(_pair(start), _pair(end))
    length = reach * half_turn / float(np.sin(half_turn))
    return Curve(float(start[0]), float(start[1]), heading, 2.0 * half_turn / length, length)


def _to_curve(points: Floats, curve: Curve) -> Floats:
    x, y = points[:, 0] - curve.x_m, points[:, 1] - curve.y_m
    cos, sin = np.cos(curve.heading_rad), np.sin(curve.heading_rad)
    along, left = cos * x + sin * y, cos * y - sin * x
    if curve.curvature_1pm == 0.0:
        return np.asarray(np.hypot(along - np.clip(along, 0.0, curve.length_m), left))
    radius, sign = 1.0 / abs(curve.curvature_1pm), np.sign(curve.curvature_1pm)
    turned = np.arctan2(along, radius - sign * left) % (2 * np.pi)
    total = curve.length_m / radius
    # Beyond the arc's ends the nearer end is the nearest point.
    nearest = np.where(turned <= total, turned, np.where(turned - total < 2 * np.pi - turned, total, 0.0))
    return np.asarray(np.hypot(along - radius * np.sin(nearest), sign * left - radius * (1.0 - np.cos(nearest))))


def _pair(point: Floats) -> tuple[float, float]:
    return (float(point[0]), float(point[1]))
