"""Deviation between a drawing's lines and a template's."""

from collections.abc import Sequence

import numpy as np

from touchline.drawings.arc_columns import columns, distances
from touchline.drawings.outline import Floats, Piece, Smooth
from touchline.schemas.curves import Curve

#: Maximum number of pairs of points and curves that are all compared; beyond it, only near curves are.
_ALL = 200_000
#: Approximate number of points by which near curves are found, and number of curves that count as near.
_POSTS, _NEAR = 20_000, 8
#: Maximum number of samples of a piece, and their spacing, m.
SAMPLES, SAMPLES_M = 64, 2e-3


def distance_m(points: Floats, curves: Sequence[Curve]) -> Floats:
    """Distances (n,) of points (n, 2) to the nearest of ``curves``, m."""
    rows, at = columns(list(curves)), points[:, 0] + 1j * points[:, 1]
    if len(points) * len(rows) <= _ALL:
        return np.asarray(distances(at[:, None], rows[None]).min(axis=1))
    from scipy.spatial import cKDTree

    spacing = rows[:, 4].sum() / _POSTS
    posts = [sampled(curve, int(curve.length_m / spacing) + 2) for curve in curves]
    owner = np.repeat(np.arange(len(rows)), [len(each) for each in posts])
    _, near = cKDTree(np.concatenate(posts)).query(points, k=_NEAR)
    return np.asarray(distances(at[:, None], rows[owner[near]]).min(axis=1))


def sampled(piece: Piece, count: int) -> Floats:
    """Points (count, 2) of a piece of an outline, ends included, m."""
    if isinstance(piece, Smooth):
        return piece.point(np.linspace(piece.breaks[0], piece.breaks[-1], count))
    return np.column_stack(piece.at(np.linspace(0.0, piece.length_m, count))[:2])


def apart_m(drawn: Sequence[Curve], painted: Sequence[Curve], most: int = SAMPLES) -> tuple[float, tuple[float, float]]:
    """Maximum deviation between two sets of curves, in either direction, m, and its position (x, y).

    Args:
        drawn: Curves of the drawing.
        painted: Curves of the template.
        most: Maximum number of samples of a curve.
    """
    worst, where = 0.0, (0.0, 0.0)
    for these, those in ((drawn, painted), (painted, drawn)):
        known = set(those)
        points = [sampled(c, min(most, int(c.length_m / SAMPLES_M) + 2)) for c in these if c not in known]
        if points:
            every = np.concatenate(points)
            away = distance_m(every, those)
            if away.max() > worst:
                worst, where = float(away.max()), (float(every[away.argmax(), 0]), float(every[away.argmax(), 1]))
    return worst, where
