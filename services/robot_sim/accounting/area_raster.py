"""Raster of a template's areas, in which the ground that a tool passes over is counted.

A cell is passed over when the tool's line (across its path, as wide as it works) goes over the cell's middle: each pass
over it, forward or backward, counts once. Neighbouring steps share a line, so none is counted twice and none left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.records import Record
from touchline.services.robot_sim.paint import projection as p
from touchline.services.robot_sim.paint.cell_grid import CellFrame

if TYPE_CHECKING:
    import shapely

CELL_M: Final = 0.05
MOST_CELLS: Final = 32_000_000
"""Limit of the number of cells, two bytes each; more ground than that (8 ha) is counted in larger cells."""

# Columns of the totals, a row per area.
_ONCE: Final = 0
_TWICE: Final = 1
_TOTALS: Final = 2

_SHORTEST_M: Final = 1e-3
"""Length below which a step is ignored, because its direction is uncertain."""
_MOST_TIMES: Final = 255

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Bytes = NDArray[np.uint8]


class ToolLine(Record):
    """Position of the line across the tool's path, map frame."""

    x_m: float
    """Middle of the line, with `y_m`."""
    y_m: float
    ahead_x: float
    """Unit vector ahead of the line, with `ahead_y`; 0 before it has moved."""
    ahead_y: float


class CountedGround(NamedTuple):
    """Arrays in which the kernels count.

    Attributes:
        frame: Frame of the raster.
        area: Number of the area of each cell, 0 outside.
        times: Number of passes over each cell.
        totals: (areas, _TOTALS) cells of each area that were passed over at least once, and at least twice.
    """

    frame: CellFrame
    area: Bytes
    times: Bytes
    totals: Integers


@kernel
def _sweep(
    before: tuple[float, float, float, float],
    after: tuple[float, float, float, float],
    half_width: float,
    ground: CountedGround,
) -> None:
    """Count the cells between two lines (x, y, ahead x, ahead y) of the tool."""
    (west, south, cell, columns, rows), area, times, totals = ground
    ax, ay, aux, auy = before[0] - west, before[1] - south, before[2], before[3]
    bx, by, bux, buy = after[0] - west, after[1] - south, after[2], after[3]
    # Rows of cells across the tool's path are visited one by one; there are few cells of each between the lines.
    turned = abs(bux) < abs(buy)
    if turned:
        ax, ay, aux, auy = ay, ax, auy, aux
        bx, by, bux, buy = by, bx, buy, bux
        columns, rows = rows, columns
    reach = half_width * max(abs(aux), abs(bux))
    first = max(0, math.ceil((min(ay, by) - reach) / cell - 0.5))
    last = min(rows - 1, math.floor((max(ay, by) + reach) / cell - 0.5))
    for row in range(first, last + 1):
        y = (row + 0.5) * cell
        xa = ax - (y - ay) * auy / aux
        xb = bx - (y - by) * buy / bux
        low = max(0, math.floor(min(xa, xb) / cell - 0.5))
        high = min(columns - 1, math.ceil(max(xa, xb) / cell - 0.5))
        for column in range(low, high + 1):
            x = (column + 0.5) * cell
            behind = (x - ax) * aux + (y - ay) * auy < 0.0
            if behind == ((x - bx) * bux + (y - by) * buy < 0.0):
                continue
            aside = (y - by) * bux - (x - bx) * buy
            if aside < -half_width or aside >= half_width:
                continue
            at = column * rows + row if turned else row * columns + column
            index = area[at]
            if index == 0:
                continue
            if times[at] < _TOTALS:
                totals[index - 1, times[at]] += 1
            if times[at] < _MOST_TIMES:
                times[at] += 1


@kernel
def roll(points: Floats, first: int, full_width_m: float, lines: Sequence[ToolLine], ground: CountedGround) -> None:
    """Count the cells that strokes pass over.

    Args:
        points: (n, projection.POINT_COLUMNS) of the ledger.
        first: Index of the point to begin with.
        full_width_m: Width of the tool.
        lines: (1,) last position of the tool's line, updated.
        ground: Counters, updated.
    """
    line = lines[0]
    for row in range(first, len(points)):
        x, y = points[row, p.POINT_X], points[row, p.POINT_Y]
        if points[row, p.POINT_TARGET] == p.STROKE_BEGINS:
            line.x_m, line.y_m, line.ahead_x, line.ahead_y = x, y, 0.0, 0.0
            continue
        dx, dy = x - line.x_m, y - line.y_m
        moved = math.hypot(dx, dy)
        if moved < _SHORTEST_M:
            continue
        ux, uy = dx / moved, dy / moved
        ahead_x, ahead_y = line.ahead_x, line.ahead_y
        if ahead_x == 0.0 and ahead_y == 0.0:
            ahead_x, ahead_y = ux, uy
        elif ahead_x * ux + ahead_y * uy < 0.0:  # it has turned back: the line keeps its orientation
            ux, uy = -ux, -uy
        half = 0.5 * full_width_m * points[row, p.POINT_WIDTH]
        _sweep((line.x_m, line.y_m, ahead_x, ahead_y), (x, y, ux, uy), half, ground)
        line.x_m, line.y_m, line.ahead_x, line.ahead_y = x, y, ux, uy


class AreaRaster:
    """Counter of the passes over each cell of some areas.

    Args:
        areas: Areas that do not overlap; a cell in two of them counts for the later one only.
        width_m: Working width of the tool.
        cell_m: Edge of a cell, unless that makes more than `MOST_CELLS`.

    Attributes:
        cell_m: Edge of a cell.
        cells: Number of cells of each area.
    """

    def __init__(self, areas: Sequence[shapely.Polygon], width_m: float, cell_m: float = CELL_M) -> None:
        bounds = np.array([area.bounds for area in areas])
        (west, south), (east, north) = bounds[:, :2].min(axis=0).tolist(), bounds[:, 2:].max(axis=0).tolist()
        self.cell_m = max(cell_m, math.sqrt((east - west) * (north - south) / MOST_CELLS))
        columns, rows = (max(1, math.ceil(size / self.cell_m)) for size in (east - west, north - south))
        self._width_m = width_m
        frame = CellFrame(west, south, self.cell_m, columns, rows)
        index: Bytes = np.zeros((rows, columns), dtype=np.uint8)
        for number, area in enumerate(areas, 1):
            index[_inside(area, frame)] = number
        totals: Integers = np.zeros((len(areas), _TOTALS), dtype=np.int64)
        self._ground = CountedGround(frame, index.ravel(), np.zeros(index.size, dtype=np.uint8), totals)
        self._line = ToolLine()
        self._taken = 0
        self.cells: list[int] = np.bincount(self._ground.area, minlength=len(areas) + 1)[1:].tolist()

    def take(self, points: Floats) -> None:
        """Count the strokes since the last call; (n, projection.POINT_COLUMNS) are all of a ledger's `points`."""
        if len(points) > self._taken:
            self._roll(points, self._taken, self._width_m, self._line.array, self._ground)
            self._taken = len(points)

    @cached_property
    def _roll(self) -> Callable[..., None]:
        """The kernel `roll`, without checking the types of its arguments, which are always the same."""
        points: Floats = np.zeros((0, p.POINT_COLUMNS))
        code: Callable[..., None] = roll.for_types_of((points, 0, self._width_m, self._line.array, self._ground))
        return code

    @property
    def covered(self) -> list[int]:
        """Number of cells of each area that were passed over."""
        cells: list[int] = self._ground.totals[:, _ONCE].tolist()
        return cells

    @property
    def overlapped(self) -> list[int]:
        """Number of cells of each area that were passed over more than once."""
        cells: list[int] = self._ground.totals[:, _TWICE].tolist()
        return cells

    @property
    def times(self) -> Bytes:
        """Number of passes over each cell (rows, columns), from the south-west on; 0 outside the areas."""
        return self._ground.times.reshape(self._ground.frame.rows, self._ground.frame.columns)


def _inside(area: shapely.Polygon, frame: CellFrame) -> NDArray[np.bool_]:
    """Find the cells (rows, columns) whose middle is inside: between a row's crossings of edges, pairwise."""
    west, south, cell, columns, rows = frame
    rings = [np.asarray(ring.coords) for ring in (area.exterior, *area.interiors)]
    edges = np.concatenate([np.hstack((ring[:-1], ring[1:])) for ring in rings])
    x0, y0, x1, y1 = ((edges - [west, south, west, south]) / cell - 0.5).T  # the middles of cells are whole numbers
    low, high = np.ceil(np.minimum(y0, y1)), np.ceil(np.maximum(y0, y1))
    low, high = np.clip(low, 0, rows).astype(np.int64), np.clip(high, 0, rows).astype(np.int64)
    many = high - low
    edge = np.repeat(np.arange(len(edges)), many)
    row = np.arange(len(edge)) - np.repeat(np.cumsum(many) - many, many) + low[edge]
    x = x0[edge] + (row - y0[edge]) * (x1 - x0)[edge] / (y1 - y0)[edge]
    column = np.clip(np.ceil(x), 0, columns).astype(np.int64)
    order = np.lexsort((x, row))
    change: NDArray[np.int8] = np.zeros((rows, columns + 1), dtype=np.int8)
    np.add.at(change, (row[order][0::2], column[order][0::2]), 1)
    np.add.at(change, (row[order][1::2], column[order][1::2]), -1)
    return np.cumsum(change, axis=1, dtype=np.int8)[:, :-1] > 0
