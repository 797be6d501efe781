"""Raster that counts the passes of strokes and transitions while a plan grows."""

import math
from functools import cached_property
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from touchline.services.planner.coverage.kernels.grid import (
    BEND_STEP_M,
    BLOCK,
    COLUMNS,
    PassGrid,
    begin_query,
    count_open,
    fill,
    pass_path,
)
from touchline.services.planner.coverage.shapes import Area
from touchline.services.planner.geometry.clothoid import Floats, PiecePath

# Cell size: 5 cm on small fields; then up to 10 cm at this number of cells; then whatever the maximum number needs.
CELLS_M, CELLS, MOST_CELLS = (0.05, 0.1), 450_000, 4_000_000


class RasterState(NamedTuple):
    """Snapshot of a raster: passes by cell, and uncovered cells by block."""

    passes: NDArray[np.int16]
    open: NDArray[np.int32]


class CoverageRaster:
    """Passes over each cell of an area."""

    def __init__(self, wanted: Area, width_m: float, cell_m: float | None = None) -> None:
        """Create a raster with all of the area uncovered; the cell size depends on the area unless given."""
        left, low, right, high = wanted.bounds
        box_m2 = (right - left) * (high - low)
        fine_m = min(max(CELLS_M[0], math.sqrt(box_m2 / CELLS)), CELLS_M[1])
        size = cell_m or max(fine_m, math.sqrt(box_m2 / MOST_CELLS))
        shape = (math.ceil((high - low) / size) + 1, math.ceil((right - left) / size) + 1)
        blocks = (math.ceil(shape[0] / BLOCK), math.ceil(shape[1] / BLOCK))
        seen, query = np.zeros(shape, np.int32), np.zeros(1, np.int32)
        passes, opened, spans = np.zeros(shape, np.int16), np.zeros(blocks, np.int32), np.zeros((shape[0], 2))
        unwanted, half_width_m = np.zeros(shape, np.bool_), 0.5 * width_m
        self.grid = PassGrid(half_width_m, left, low, size, unwanted, passes, seen, opened, query, spans)
        for part in shapely.get_parts(wanted):
            rings = [np.array(ring.coords)[:, :2] for ring in (part.exterior, *part.interiors)]
            edges = np.concatenate([np.hstack((ring[:-1], ring[1:])) for ring in rings])
            # Parts are disjoint, so each is filled by itself.
            fill(edges, self.grid, True)
        count_open(self.grid)

    def add(self, path: PiecePath, change: int = 1) -> float:
        """Count a path, and return the area (m²) of what was uncovered under it."""
        begin_query(self.grid)
        table: Floats = np.array(path.pieces, dtype=np.float64).reshape(-1, COLUMNS)
        start = np.array(path.start, dtype=np.float64)
        found = pass_path(start, table, len(table), self.grid, change, BEND_STEP_M)
        return float(found) * self.grid.cell_m**2

    def take(self, path: PiecePath) -> None:
        """Discount a path."""
        self.add(path, -1)

    @property
    def counts(self) -> RasterState:
        """Snapshot for `count_as`."""
        return RasterState(self.grid.passes.copy(), self.grid.open.copy())

    def count_as(self, counts: RasterState) -> None:
        """Return to a snapshot."""
        self.grid.passes[:], self.grid.open[:] = counts

    def clear(self) -> None:
        """Discount everything."""
        self.grid.passes[:] = 0
        count_open(self.grid)

    @cached_property
    def wanted_m2(self) -> float:
        """Area to cover (m²)."""
        return float(np.count_nonzero(self.grid.wanted)) * self.grid.cell_m**2

    @property
    def missed_m2(self) -> float:
        """Area not covered yet (m²)."""
        return float(self.grid.open.sum()) * self.grid.cell_m**2
