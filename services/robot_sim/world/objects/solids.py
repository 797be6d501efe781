"""Outlines and discs that stand still, in a grid of square cells for rays that look for them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Columns of a solid: an edge of an outline from one end to the other, or a disc (radius > 0) round the first.
X1: Final = 0
Y1: Final = 1
X2: Final = 2
Y2: Final = 3
RADIUS: Final = 4
HEIGHT: Final = 5
DARK: Final = 6  # 1 for a dark surface
SOLID_COLUMNS: Final = 7

_LEAST_CELL_M: Final = 3.0
_MOST_CELLS: Final = 512  # in a row


class SolidGrid(NamedTuple):
    """Solids by the cells that their bounding boxes touch.

    Attributes:
        solids: (n, SOLID_COLUMNS), map frame [m].
        first: (cells + 1,) first place in `items` of each cell, row by row from the south-west.
        items: Indices of solids, cell by cell.
        corner: (2,) south-west corner of the grid [m].
        size: (2,) cells to the east and to the north.
        cell_m: Length of a cell's side.
        looked_at: (n + 1,) scratch: scan in which each solid was looked at last; at the end the number of scans.
    """

    solids: Floats
    first: Integers
    items: Integers
    corner: Floats
    size: Integers
    cell_m: float
    looked_at: Integers


def solid_grid(solids: Sequence[Sequence[float]]) -> SolidGrid:
    """Put solids into a grid.

    Args:
        solids: (n, SOLID_COLUMNS).
    """
    rows = np.array(solids, dtype=np.float64).reshape(-1, SOLID_COLUMNS)
    looked_at: Integers = np.zeros(len(rows) + 1, np.int64)
    if not len(rows):
        nothing: Integers = np.zeros(0, np.int64)
        return SolidGrid(rows, np.zeros(2, np.int64), nothing, np.zeros(2), np.ones(2, np.int64), 1.0, looked_at)
    radius = rows[:, RADIUS, None]
    low = np.minimum(rows[:, :2], rows[:, 2:4]) - radius
    high = np.maximum(rows[:, :2], rows[:, 2:4]) + radius
    corner: Floats = low.min(0)
    extent = float((high.max(0) - corner).max())
    cell_m = max(_LEAST_CELL_M, extent / _MOST_CELLS)
    from_cell, to_cell = (np.floor((each - corner) / cell_m).astype(np.int64) for each in (low, high))
    size = to_cell.max(0) + 1
    members: list[list[int]] = [[] for _ in range(math.prod(size.tolist()))]
    for index in range(len(rows)):
        for row in range(from_cell[index, 1], to_cell[index, 1] + 1):
            for column in range(from_cell[index, 0], to_cell[index, 0] + 1):
                members[row * size[0] + column].append(index)
    first: Integers = np.cumsum([0, *map(len, members)], dtype=np.int64)
    items: Integers = np.array([index for each in members for index in each], dtype=np.int64)
    return SolidGrid(rows, first, items, corner, size, cell_m, looked_at)
