"""Fit of biarcs to smooth curves by the curve's tangents: lines and arcs are all that the robot drives.

Where a biarc strays further than the tolerance its span is halved.
"""

from collections.abc import Sequence

import numpy as np

from touchline.drawings.arc_columns import COINCIDENT_M, Complexes, biarcs, curves_of, distances, lines
from touchline.drawings.outline import Floats, Outline, Smooth
from touchline.schemas.curves import Curve

#: Tolerance of the fit, and the fraction of it that is allowed at samples.
TOLERANCE_M, SHARE = 1e-3, 0.9
SAMPLES, STEEPEST_RAD, DEPTH = 24, np.pi / 2, 24
#: Fraction of a span whose chord replaces a vanishing tangent.
CHORD_SHARE = 1e-4


def fit_outline(outline: Outline, tolerance_m: float = TOLERANCE_M) -> list[Curve]:
    """Convert an outline to lines and arcs; drawn ones are kept, smooth curves are fitted within ``tolerance_m``."""
    fitted = iter(fit_all([piece for piece in outline.pieces if isinstance(piece, Smooth)], tolerance_m))
    curves: list[Curve] = []
    for piece in outline.pieces:
        curves += [piece] if isinstance(piece, Curve) else next(fitted)
    return [curve for curve in curves if curve.length_m > COINCIDENT_M]


def fit(smooth: Smooth, tolerance_m: float = TOLERANCE_M) -> list[Curve]:
    """Fit lines and arcs to a smooth curve within ``tolerance_m``; headings are continuous where the curve's are."""
    return fit_all([smooth], tolerance_m)[0]


def fit_all(smooths: Sequence[Smooth], tolerance_m: float = TOLERANCE_M) -> list[list[Curve]]:
    """Fit many smooth curves at once; see `fit`."""
    todo = [np.column_stack((smooth.breaks[:-1], smooth.breaks[1:])) for smooth in smooths]
    found: list[list[tuple[float, Floats]]] = [[] for _ in smooths]
    for depth in range(DEPTH, -1, -1):
        busy = [k for k, spans in enumerate(todo) if len(spans)]
        if not busy:
            break
        owner = np.repeat(busy, [len(todo[k]) for k in busy])
        spans = np.concatenate([todo[k] for k in busy])
        points = np.concatenate([_points(smooths[k], todo[k]) for k in busy])
        leave = np.concatenate([_tangents(smooths[k], todo[k][:, 0], todo[k][:, 1]) for k in busy])
        arrive = np.concatenate([_tangents(smooths[k], todo[k][:, 1], todo[k][:, 0]) for k in busy])
        fitted, fits = biarcs(points[:, 0], leave, points[:, -1], -arrive)
        there = np.abs(points - points[:, :1]).max(axis=1) >= COINCIDENT_M
        off = distances(points[:, :, None], fitted[:, None]).min(axis=2).max(axis=1)
        turns = np.abs(fitted[:, :, 3] * fitted[:, :, 4]).max(axis=1)
        fits &= (off <= SHARE * tolerance_m) & (turns <= STEEPEST_RAD)
        if depth == 0:
            fitted[~fits, 0], fitted[~fits, 1, 4] = lines(points[~fits, 0], points[~fits, -1]), 0.0
            fits[:] = True
        for k, begin, rows in zip(owner[fits & there], spans[fits & there, 0], fitted[fits & there], strict=True):
            found[k].append((begin, rows))
        again = there & ~fits
        middle = spans[again].mean(axis=1)
        halves = np.concatenate(
            (np.column_stack((spans[again, 0], middle)), np.column_stack((middle, spans[again, 1])))
        )
        owners = np.tile(owner[again], 2)
        order = np.argsort(owners, kind="stable")
        todo = np.split(halves[order], np.searchsorted(owners[order], np.arange(1, len(smooths))))
    return [_in_order(smooth, rows) for smooth, rows in zip(smooths, found, strict=True)]


def _in_order(smooth: Smooth, found: list[tuple[float, Floats]]) -> list[Curve]:
    found.sort(key=lambda item: item[0], reverse=smooth.breaks[-1] < smooth.breaks[0])
    return curves_of(np.array([rows for _, rows in found])) if found else []


def _points(smooth: Smooth, spans: Floats) -> Complexes:
    """Points (n, SAMPLES) of spans (n, 2), ends included."""
    share = np.linspace(0.0, 1.0, SAMPLES)
    at = spans[:, :1] * (1.0 - share) + spans[:, 1:] * share
    x, y = smooth.point(at.ravel()).T
    return np.asarray((x + 1j * y).reshape(at.shape))


def _tangents(smooth: Smooth, at: Floats, towards: Floats) -> Complexes:
    """Unit tangents (n,) of the curve at ``at`` (n,) towards ``towards``, also where its derivative vanishes."""
    count, step = len(at), (towards - at) * CHORD_SHARE
    x, y = smooth.point(np.concatenate((at + step, at + step / 2, at))).T
    near, nearer, here = np.split(x + 1j * y, 3)
    chord = near - here
    dx, dy = smooth.derivative(at).T
    slope = (dx + 1j * dy) * step
    # A cusp or a handle of no length: the chords' directions, extrapolated to a chord of no length.
    stands = np.abs(slope) < 0.5 * np.abs(chord)
    return _units(np.where(stands, 2.0 * _units(nearer - here) - _units(chord), slope).reshape(count))


def _units(vectors: Complexes) -> Complexes:
    size = np.abs(vectors)
    return np.where(size > 0.0, vectors / np.where(size > 0.0, size, 1.0), 1.0)
