"""Grid over the field for finding lines or boxes near a point, so that thousands cost no more than a few."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.schemas.curves import Curve

SMALLEST_CELL_M: Final = 2.0
MOST_CELLS: Final = 65536


class CellFrame(NamedTuple):
    """Square cells of a field, map frame: rows of them from the south-west corner on."""

    west_m: float
    south_m: float
    cell_m: float
    """Edge of a cell."""
    columns: int
    rows: int


class Grid(NamedTuple):
    """Lists of lines by cell; a cell's list holds every line within reach of any of its points, ascending."""

    frame: CellFrame
    starts: NDArray[np.int64]
    """Index in `members` at which each cell's list begins, (cells + 1,)."""
    members: NDArray[np.int64]
    largest: int
    """Length of the longest list."""


def make_grid(lines: Sequence[Curve], reach_m: float) -> Grid:
    """Make the grid of lines; the straight continuation of a line counts as the line.

    Args:
        lines: Lines and arcs, map frame.
        reach_m: Distance within which a line is listed.
    """
    if not lines:
        return Grid(CellFrame(0.0, 0.0, 1.0, 0, 0), np.zeros(1, np.int64), np.zeros(0, np.int64), 0)
    # Twice the reach: beside the line and beyond its end at once, and half a sampling step.
    margin = 2.0 * reach_m
    samples = [np.column_stack(line.at(_steps(line.length_m, reach_m))[:2]) for line in lines]
    low = np.min([points.min(axis=0) for points in samples], axis=0) - margin
    high = np.max([points.max(axis=0) for points in samples], axis=0) + margin
    frame = _frame(low, high, SMALLEST_CELL_M, MOST_CELLS)
    corners = ((-margin, -margin), (-margin, margin), (margin, -margin), (margin, margin))
    cells = [_cells(points + np.array(corner), frame) for points in samples for corner in corners]
    counts = [len(points) for points in samples for _ in corners]
    return _listed(cells, np.repeat(np.repeat(np.arange(len(lines)), len(corners)), counts), frame)


def grid_of_boxes(low: NDArray[np.float64], high: NDArray[np.float64], smallest_m: float, most_cells: int) -> Grid:
    """Make the grid of boxes; its cells are no smaller than any of them.

    Args:
        low: (n, 2) lower corners [m].
        high: (n, 2) upper corners [m].
        smallest_m: Smallest edge of a cell.
        most_cells: Largest number of cells.
    """
    least_m = max(smallest_m, float((high - low).max()))
    frame = _frame(low.min(axis=0), high.max(axis=0), least_m, most_cells)
    corners = [np.column_stack((x[:, 0], y[:, 1])) for x in (low, high) for y in (low, high)]
    return _listed([_cells(corner, frame) for corner in corners], np.tile(np.arange(len(low)), len(corners)), frame)


def _frame(low: NDArray[np.float64], high: NDArray[np.float64], smallest_m: float, most_cells: int) -> CellFrame:
    (west, south), (width, height) = low.tolist(), (high - low).tolist()
    cell = max(smallest_m, math.sqrt(width * height / most_cells))
    return CellFrame(west, south, cell, int(width / cell) + 1, int(height / cell) + 1)


def _cells(points: NDArray[np.float64], frame: CellFrame) -> NDArray[np.int64]:
    """Return the index of the cell of each point (n, 2); of the nearest one for points outside."""
    at = np.floor((points - (frame.west_m, frame.south_m)) / frame.cell_m).astype(np.int64)
    row, column = np.clip(at[:, 1], 0, frame.rows - 1), np.clip(at[:, 0], 0, frame.columns - 1)
    return np.asarray(row * frame.columns + column)


def _listed(cells: list[NDArray[np.int64]], members: NDArray[np.int64], frame: CellFrame) -> Grid:
    """Make the grid with these members in these cells, once each."""
    many = int(members.max()) + 1
    cell, member = np.divmod(np.unique(np.concatenate(cells) * many + members), many)
    counts = np.bincount(cell, minlength=frame.columns * frame.rows)
    starts = np.concatenate(([0], np.cumsum(counts))).astype(np.int64)
    return Grid(frame, starts, member, int(counts.max()))


@kernel
def cell_of(x: float, y: float, frame: CellFrame) -> int:
    """Return the index of the cell of a point, −1 outside the grid.

    Args:
        x: East, map frame [m].
        y: North, map frame [m].
        frame: Frame of the `Grid`.
    """
    column, row = math.floor((x - frame.west_m) / frame.cell_m), math.floor((y - frame.south_m) / frame.cell_m)
    if column < 0 or row < 0 or column >= frame.columns or row >= frame.rows:
        return -1
    return row * frame.columns + column


def _steps(length_m: float, step_m: float) -> NDArray[np.float64]:
    return np.linspace(0.0, length_m, max(2, math.ceil(length_m / step_m) + 1))
