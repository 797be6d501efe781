"""Raster of the ground that a covering tool has passed over in truth, and what a report says is left out of it."""

import math
from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from touchline.schemas.messages import PaintMarks
from touchline.schemas.template import Template

Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]

CELL_M: Final = 0.05
STEP_M: Final = 0.02
"""Spacing of the tool's line, and of points of it, that are entered."""
SEAM_M: Final = 0.1
"""Distance from the edge of what is reported within which covered cells say nothing, and half the width of strips."""


class CoveredCells(NamedTuple):
    """Cells of a template's areas.

    Attributes:
        middles_m: (n, 2) their middles.
        covered: (n,) True where the tool has passed.
    """

    middles_m: Floats
    covered: Bools

    @property
    def size_m2(self) -> float:
        """Covered ground."""
        return float(self.covered.sum()) * CELL_M**2


def covered_cells(template: Template, strokes: Iterable[PaintMarks]) -> CoveredCells:
    """Enter true strokes in a raster of a template's areas."""
    areas = shapely.union_all([area.polygon for area in template.areas])
    west, south, east, north = areas.bounds
    shape = math.ceil((east - west) / CELL_M), math.ceil((north - south) / CELL_M)
    passed = np.zeros(shape, dtype=bool)
    for stroke in strokes:
        places = _under(stroke)
        column, row = np.floor((places - (west, south)) / CELL_M).astype(int).T
        inside = (column >= 0) & (row >= 0) & (column < shape[0]) & (row < shape[1])
        passed[column[inside], row[inside]] = True
    middles = (np.indices(shape).reshape(2, -1).T + 0.5) * CELL_M + (west, south)
    inside = shapely.contains_xy(areas, *middles.T)
    return CoveredCells(middles[inside], passed.ravel()[inside])


def untrue_m2(cells: CoveredCells, patches: Sequence[Sequence[Sequence[float]]]) -> float:
    """Return the ground that a report says is left out and is covered, and what is neither, but for strips.

    Args:
        cells: True cells.
        patches: Outlines of the patches that are left out, as in a report.
    """
    told = shapely.union_all([shapely.Polygon(outline).buffer(0.0) for outline in patches])
    points = shapely.points(cells.middles_m)
    inside, seam = shapely.contains(told, points), shapely.distance(told.boundary, points) < SEAM_M
    half_m = 0.5 * CELL_M + 1e-6  # no slits between neighbours
    corners = (cells.middles_m[~cells.covered & ~inside] + side for side in (-half_m, half_m))
    missed = shapely.union_all(shapely.box(*np.concatenate(list(corners), axis=1).T))
    strips_off = missed.buffer(-SEAM_M).buffer(SEAM_M)
    return float((cells.covered & inside & ~seam).sum()) * CELL_M**2 + float(strips_off.area)


def _under(stroke: PaintMarks) -> Floats:
    """Return points (n, 2) under the tool's line, all along a stroke."""
    ends = _thinned(np.column_stack((stroke.x_m, stroke.y_m)))
    ahead = np.diff(ends, axis=0)
    lengths = np.hypot(*ahead.T)
    if not len(lengths):
        return np.zeros((0, 2))
    at = np.concatenate(([0.0], np.cumsum(lengths)))
    along = np.arange(0.0, at[-1], STEP_M)
    piece = np.clip(np.searchsorted(at, along, side="right") - 1, 0, len(lengths) - 1)
    unit = ahead[piece] / lengths[piece, None]
    middles = ends[piece] + unit * (along - at[piece])[:, None]
    half_m = 0.5 * (stroke.width_m - CELL_M)  # then they are in cells whose middles are under it
    across = np.linspace(-half_m, half_m, math.ceil(2.0 * half_m / STEP_M) + 1)
    left = np.column_stack((-unit[:, 1], unit[:, 0]))
    under: Floats = middles[:, None] + across[:, None] * left[:, None]
    return under.reshape(-1, 2)


def _thinned(points: Floats) -> Floats:
    """Leave out points nearer than a step to the last one: where the robot stands they lead in any direction."""
    kept = [points[0]]
    for point in points[1:]:
        if math.dist(point, kept[-1]) >= STEP_M:
            kept.append(point)
    return np.array(kept)
