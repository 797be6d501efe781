"""Grid for TOPP: cells of constant sharpness along the path, each with a cap on the squared speed."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from touchline.services.planner.geometry.clothoid import Floats, Piece
from touchline.services.planner.limits import Limits
from touchline.services.planner.segments.section import Section
from touchline.services.planner.segments.sent_segments import Sent
from touchline.services.planner.speed.topp import CELL_CURVATURE_1PM

# Borders closer than this (m) are merged.
BORDER_M = 1e-9


@dataclass(frozen=True)
class PathGrid:
    """Cells of the ideal curve and the knots between them.

    Attributes:
        station_m: (n + 1,) arc length of the knots, as sent.
        length_m: (n,) length of the cells on the ideal curve, which differs a little.
        curvature_1pm, sharpness_1pm2: (n,) curvature at the start of the cell, and its change per metre.
        square_cap: (n,) cap on v², m²/s².
        stops: Knots where the robot stops.
        spins: Knots where it turns on the spot, and the angles (rad).
    """

    station_m: Floats
    length_m: Floats
    curvature_1pm: Floats
    sharpness_1pm2: Floats
    square_cap: Floats
    stops: tuple[int, ...] = ()
    spins: tuple[tuple[int, float], ...] = ()


def course(sections: Sequence[Section], sent: Sequence[Sent], borders_m: Iterable[float], limits: Limits) -> PathGrid:
    """Divide all sections into cells, with additional borders at the arc lengths `borders_m` (as sent).

    Args:
        sections: Ideal curve.
        sent: Lines and arcs that approximate it.
        borders_m: Additional borders (arc length as sent).
        limits: Limits of the plan.
    """
    pieces = [piece for section in sections for piece in section.path.pieces]
    table = np.array([piece[:3] for piece in pieces])
    ends = np.cumsum(table[:, 0])
    starts = ends - table[:, 0]
    ideal_at = np.array([0.0, *(s.ideal_to_m for s in sent)])
    sent_at = np.array([0.0, *(s.end_m for s in sent)])

    asked = np.interp([s for s in borders_m if 0.0 < s < sent_at[-1]], sent_at, ideal_at)
    border = np.unique(np.concatenate(([0.0], ideal_at, ends, asked, *_subdivisions(pieces, starts))))
    border = border[np.concatenate(([True], np.diff(border) > BORDER_M))]
    middle = 0.5 * (border[1:] + border[:-1])
    piece = np.minimum(np.searchsorted(ends, middle), len(pieces) - 1)
    sharpness = table[piece, 2]
    curvature = table[piece, 1] + sharpness * (border[:-1] - starts[piece])
    at_end = curvature + sharpness * np.diff(border)
    as_sent = np.array([abs(s.curve.curvature_1pm) for s in sent])[
        np.minimum(np.searchsorted(ideal_at[1:], middle), len(sent) - 1)
    ]
    tightest = np.maximum(np.maximum(np.abs(curvature), np.abs(at_end)), as_sent)
    cap = limits.square_cap(tightest, np.abs(sharpness))
    stops, spins = _stops(pieces, ends, border)
    station = np.interp(border, ideal_at, sent_at)
    return PathGrid(station, np.diff(border), curvature, sharpness, cap, stops, spins)


def _subdivisions(pieces: Sequence[Piece], starts: Floats) -> list[Floats]:
    divided = []
    for piece, start in zip(pieces, starts.tolist(), strict=True):
        if piece.sharpness_1pm2:
            # At least two: between two stops the robot has to move.
            parts = max(math.ceil(abs(piece.sharpness_1pm2) * piece.length_m / CELL_CURVATURE_1PM), 2)
            divided.append(start + piece.length_m * np.arange(1, parts) / parts)
    return divided


def _stops(
    pieces: Sequence[Piece], ends: Floats, border: Floats
) -> tuple[tuple[int, ...], tuple[tuple[int, float], ...]]:
    """Knots at cusps and turns on the spot, and the angles of the latter."""
    stops, spins = [], []
    for (last, following), station in zip(pairwise(pieces), ends.tolist(), strict=False):
        if following.spin_rad or last.direction != following.direction:
            knot = int(np.argmin(np.abs(border - station)))
            stops.append(knot)
            if following.spin_rad:
                spins.append((knot, following.spin_rad))
    if pieces and pieces[0].spin_rad:
        spins.insert(0, (0, pieces[0].spin_rad))
    return tuple(stops), tuple(spins)
