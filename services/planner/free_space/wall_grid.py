"""Walls in a grid, so that a body among them need only look at those near to it."""

from __future__ import annotations

from typing import Final, NamedTuple, Self

import numpy as np

from touchline.services.planner.geometry.clothoid import Floats, Ints

SIDE_M: Final = 0.5
# Cells of a side at most: on wide ground they are larger.
CELLS_MAX: Final = 200


class WallGrid(NamedTuple):
    """Edges of obstructed ground, and which of them are in or near each square cell of a grid.

    Attributes:
        edges: (n, 4) x₁ y₁ x₂ y₂ (m).
        low: (2,) lower left corner of the grid (m).
        side_m: Side of a cell.
        shape: (2,) number of cells along x and y.
        begins: (cells + 1,) where the walls of each cell begin in `within`; cell (i, j) is number i · shape[1] + j.
        within: (m,) numbers of the walls that each cell's square meets.
    """

    edges: Floats
    low: Floats
    side_m: float
    shape: Ints
    begins: Ints
    within: Ints

    @classmethod
    def of(cls, edges: Floats) -> Self:
        """Grid of edges (n, 4) x₁ y₁ x₂ y₂ (m)."""
        ends = edges.reshape(-1, 2)
        low, high = (ends.min(axis=0), ends.max(axis=0)) if len(ends) else (np.zeros(2), np.zeros(2))
        side_m = max(SIDE_M, float((high - low).max()) / CELLS_MAX)
        shape = np.floor((high - low) / side_m).astype(np.int64) + 1
        begin = np.floor((np.minimum(edges[:, :2], edges[:, 2:]) - low) / side_m).astype(np.int64)
        end = np.floor((np.maximum(edges[:, :2], edges[:, 2:]) - low) / side_m).astype(np.int64)
        sizes = end - begin + 1
        counts = sizes.prod(axis=1)
        wall = np.repeat(np.arange(len(edges)), counts)
        at = np.arange(len(wall)) - np.repeat(np.cumsum(counts) - counts, counts)
        cells = begin[wall] + np.column_stack((at // sizes[wall, 1], at % sizes[wall, 1]))
        near = _near(edges[wall], low + (cells + 0.5) * side_m, side_m)
        wall, number = wall[near], cells[near, 0] * shape[1] + cells[near, 1]
        order = np.argsort(number, kind="stable")
        begins = np.searchsorted(number[order], np.arange(int(shape.prod()) + 1))
        return cls(np.ascontiguousarray(edges), low, side_m, shape, begins, wall[order])


def _near(edges: Floats, middles: Floats, side_m: float) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Find which edges (n, 4) come into the circles round cells with these middles (n, 2)."""
    along, to_middle = edges[:, 2:] - edges[:, :2], middles - edges[:, :2]
    length = np.hypot(*along.T)
    off = np.abs(along[:, 0] * to_middle[:, 1] - along[:, 1] * to_middle[:, 0])
    return np.asarray(off <= 0.75 * side_m * length + 1e-9)
