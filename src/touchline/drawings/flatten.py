"""Closed outlines as corners: arcs and smooth curves become chords."""

import math

import numpy as np

from touchline.drawings.deviation import sampled
from touchline.drawings.outline import Floats, Outline, Piece
from touchline.schemas.curves import Curve

#: Maximum distance of chords from the drawn curve, m.
CHORD_M = 0.01
#: Minimum number of chords per turn.
CHORDS = 12
#: Initial and maximum number of points of a smooth curve.
_FEW, _MOST = 33, 4097


def ring_of(outline: Outline) -> Floats:
    """Corners (n, 2) of a closed outline, the first one not repeated; corners of the drawing are kept."""
    points = np.concatenate([_chords(piece)[:-1] for piece in outline.pieces] + [_chords(outline.pieces[-1])[-1:]])
    ring = points[np.r_[True, np.any(np.diff(points, axis=0) != 0.0, axis=1)]]
    return ring[:-1] if len(ring) > 1 and np.hypot(*(ring[0] - ring[-1])) < 1e-9 else ring


def _chords(piece: Piece) -> Floats:
    if isinstance(piece, Curve):
        curvature = abs(piece.curvature_1pm)
        turns = math.ceil(CHORDS * curvature * piece.length_m / math.tau - 1e-9)
        return sampled(piece, 1 + max(1, turns, math.ceil(piece.length_m * math.sqrt(curvature / (8 * CHORD_M)))))
    from shapely import LineString, get_coordinates

    count = _FEW
    points = sampled(piece, count)
    while count < _MOST and np.abs(points[2:] - 2 * points[1:-1] + points[:-2]).max() > CHORD_M:
        count = 2 * count - 1
        points = sampled(piece, count)
    size = float(np.ptp(points, axis=0).max())
    return np.asarray(get_coordinates(LineString(points).simplify(min(0.8 * CHORD_M, size / CHORDS**2))))
