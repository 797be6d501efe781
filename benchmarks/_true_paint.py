"""Raster of the true paint along a template's lines, and of what a report says is left out of them."""

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.arcs import abreast, unit
from touchline.schemas.curves import Curve
from touchline.schemas.messages import PaintMarks
from touchline.schemas.template import Template

Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]

RASTER_M: Final = 0.01
PAINTED_M: Final = 0.05
"""Distance from a line within which a stroke paints it."""
ALONG: Final = 0.9
"""Share of a stroke's length that it has along a line which it paints."""
TRUE_M: Final = 0.02
"""Difference between reported and true ends of a gap."""


def untrue_m(template: Template, gaps: Sequence[dict[str, Any]], strokes: Sequence[PaintMarks]) -> float:
    """Return the longest stretch (m) that a report says is left out and is painted, or the other way round.

    Args:
        template: The whole template.
        gaps: Stretches that are left out, as in a report.
        strokes: True paint.
    """
    worst_m = 0.0
    for segment in template.segments:
        curve = segment.curve()
        painted, told = painted_cells(curve, strokes), told_cells(segment.id, curve, gaps)
        worst_m = max(worst_m, longest_m(painted & told), longest_m(~painted & ~told))
    return worst_m


def told_cells(line_id: str, curve: Curve, gaps: Iterable[dict[str, Any]]) -> Bools:
    """Return which cells (n,) of a line's raster a report says are left out."""
    at_m, told = np.arange(0.0, curve.length_m, RASTER_M), np.zeros(_cells(curve), dtype=bool)
    for gap in gaps:
        if gap["line"] == line_id:
            told |= (at_m >= gap["along_m"][0]) & (at_m <= gap["along_m"][1])
    return told


def painted_cells(curve: Curve, strokes: Iterable[PaintMarks], along: float = ALONG) -> Bools:
    """Return which cells (n,) of a line's raster are painted.

    Args:
        curve: The line.
        strokes: True paint.
        along: Share of a stroke's length that it has along the line, at least; 0: paint across it counts, too.
    """
    row = np.array((curve.x_m, curve.y_m, curve.heading_rad, curve.curvature_1pm, curve.length_m))
    painted = np.zeros(_cells(curve), dtype=bool)
    for stroke in strokes:
        painted |= _painted(row, len(painted), stroke, along)
    return painted


def _cells(curve: Curve) -> int:
    return len(np.arange(0.0, curve.length_m, RASTER_M))


def _painted(row: Floats, cells: int, stroke: PaintMarks, along: float) -> Bools:
    """Return which cells (n,) of a line's raster a stroke has painted where it runs along it for this share."""
    found = np.zeros(cells, dtype=bool)
    heading = unit(float(row[2]))
    ends = np.column_stack((stroke.x_m, stroke.y_m)) @ (1.0, 1.0j)
    for a, b in pairwise(ends.tolist()):
        from_m, to_m = (abreast(point, row, heading) for point in (a, b))
        low_m, high_m = sorted((from_m, to_m))
        if high_m - low_m < along * abs(b - a):
            continue
        middle = _place(row, 0.5 * (low_m + high_m))
        if abs(0.5 * (a + b) - middle) < PAINTED_M:
            found[max(math.ceil(low_m / RASTER_M), 0) : max(math.floor(high_m / RASTER_M) + 1, 0)] = True
    return found


def _place(row: Floats, at_m: float) -> complex:
    x, y, *_ = Curve(*row.tolist()).at(at_m)
    return complex(x, y)


def longest_m(where: Bools) -> float:
    """Length of the longest run of the raster (m)."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], where.astype(int), [0]))))
    return RASTER_M * float((edges[1::2] - edges[::2]).max(initial=0))


def painted_m(template: Template, strokes: Sequence[PaintMarks]) -> float:
    """Return the length of a template's lines that is painted."""
    return RASTER_M * float(sum(painted_cells(each.curve(), strokes).sum() for each in template.segments))
