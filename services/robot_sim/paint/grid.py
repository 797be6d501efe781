"""Which lines are near a point: a grid over the field, so that thousands of lines cost no more than a few."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from schemas.curves import Curve
from schemas.jit import kernel

SMALLEST_CELL_M: Final = 2.0
MOST_CELLS: Final = 65536

# Columns of `Grid.frame`.
_WEST: Final = 0
_SOUTH: Final = 1
_CELL: Final = 2
_COLUMNS: Final = 3
_ROWS: Final = 4


class Grid(NamedTuple):
    """Lists of lines by cell; a cell's list holds every line within reach of any of its points, ascending."""

    frame: NDArray[np.float64]
    """(5,) west and south edge [m], cell size [m], columns, rows."""
    starts: NDArray[np.int64]
    """(cells + 1,) where each cell's list begins in `members`."""
    members: NDArray[np.int64]
    largest: int
    """Length of the longest list."""


def make_grid(lines: Sequence[Curve], reach_m: float) -> Grid:
    """The grid of these lines; a point is within reach of a line also if it is so of its straight continuation."""
    if not lines:
        return Grid(np.array([0.0, 0.0, 1.0, 0.0, 0.0]), np.zeros(1, np.int64), np.zeros(0, np.int64), 0)
    # Twice the reach: beside the line and beyond its end at once, and half a sampling step.
    margin = 2.0 * reach_m
    samples = [np.column_stack(line.at(_steps(line.length_m, reach_m))[:2]) for line in lines]
    low = np.min([points.min(axis=0) for points in samples], axis=0) - margin
    high = np.max([points.max(axis=0) for points in samples], axis=0) + margin
    width, height = (high - low).tolist()
    cell = max(SMALLEST_CELL_M, math.sqrt(width * height / MOST_CELLS))
    columns, rows = int(width / cell) + 1, int(height / cell) + 1
    pairs: list[NDArray[np.int64]] = []
    for index, points in enumerate(samples):
        cells: list[NDArray[np.int64]] = []
        for corner in ((-margin, -margin), (-margin, margin), (margin, -margin), (margin, margin)):
            at = np.floor((points + np.array(corner) - low) / cell).astype(np.int64)
            cells.append(np.clip(at[:, 1], 0, rows - 1) * columns + np.clip(at[:, 0], 0, columns - 1))
        found = np.unique(np.concatenate(cells))
        pairs.append(np.column_stack((found, np.full(len(found), index))))
    table = np.concatenate(pairs)
    table = table[np.lexsort((table[:, 1], table[:, 0]))]
    counts = np.bincount(table[:, 0], minlength=columns * rows)
    starts = np.concatenate(([0], np.cumsum(counts))).astype(np.int64)
    frame = np.array([low[0], low[1], cell, columns, rows])
    return Grid(frame, starts, np.ascontiguousarray(table[:, 1]), int(counts.max()))


@kernel
def cell_of(x: float, y: float, frame: NDArray[np.float64]) -> int:
    """Index of the cell of a point, −1 outside the grid."""
    column, row = math.floor((x - frame[_WEST]) / frame[_CELL]), math.floor((y - frame[_SOUTH]) / frame[_CELL])
    if column < 0 or row < 0 or column >= frame[_COLUMNS] or row >= frame[_ROWS]:
        return -1
    return int(row * frame[_COLUMNS] + column)


def _steps(length_m: float, step_m: float) -> NDArray[np.float64]:
    return np.linspace(0.0, length_m, max(2, math.ceil(length_m / step_m) + 1))
