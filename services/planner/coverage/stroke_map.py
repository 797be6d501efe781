"""The raster on which strokes and ways are counted while a plan grows."""

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
    ask,
    count_open,
    fill,
    pass_path,
)
from touchline.services.planner.coverage.shapes import Area
from touchline.services.planner.geometry.clothoid import Floats, PiecePath

# Cells of 5 cm on small fields; as many of them, up to 10 cm each; then at most so many, however large they are.
CELLS_M, CELLS, MOST_CELLS = (0.05, 0.1), 450_000, 4_000_000


class MapCounts(NamedTuple):
    """How often each cell is passed over, and what is uncovered block by block, to come back to."""

    passes: NDArray[np.int16]
    open: NDArray[np.int32]


class StrokeMap:
    """How often each place of an area is passed over."""

    def __init__(self, wanted: Area, width_m: float, cell_m: float | None = None) -> None:
        """All of the area is uncovered; cells are as small as is worth it unless said."""
        left, low, right, high = wanted.bounds
        box_m2 = (right - left) * (high - low)
        fine_m = min(max(CELLS_M[0], math.sqrt(box_m2 / CELLS)), CELLS_M[1])
        size = cell_m or max(fine_m, math.sqrt(box_m2 / MOST_CELLS))
        shape = (math.ceil((high - low) / size) + 1, math.ceil((right - left) / size) + 1)
        blocks = (math.ceil(shape[0] / BLOCK), math.ceil(shape[1] / BLOCK))
        seen, question = np.zeros(shape, np.int32), np.zeros(1, np.int32)
        passes, opened, spans = np.zeros(shape, np.int16), np.zeros(blocks, np.int32), np.zeros((shape[0], 2))
        unwanted, half_width_m = np.zeros(shape, np.bool_), 0.5 * width_m
        self.grid = PassGrid(half_width_m, left, low, size, unwanted, passes, seen, opened, question, spans)
        for part in shapely.get_parts(wanted):
            rings = [np.array(ring.coords)[:, :2] for ring in (part.exterior, *part.interiors)]
            edges = np.concatenate([np.hstack((ring[:-1], ring[1:])) for ring in rings])
            # Each part by itself, so that parts need not be looked at together.
            fill(edges, self.grid, True)
        count_open(self.grid)

    def add(self, path: PiecePath, change: int = 1) -> float:
        """Count a path; how much of what it passes over was uncovered (m²)."""
        ask(self.grid)
        table: Floats = np.array(path.pieces, dtype=np.float64).reshape(-1, COLUMNS)
        start = np.array(path.start, dtype=np.float64)
        found = pass_path(start, table, len(table), self.grid, change, BEND_STEP_M)
        return float(found) * self.grid.cell_m**2

    def take(self, path: PiecePath) -> None:
        """Count a path no more."""
        self.add(path, -1)

    @property
    def counts(self) -> MapCounts:
        """What `count_as` takes."""
        return MapCounts(self.grid.passes.copy(), self.grid.open.copy())

    def count_as(self, counts: MapCounts) -> None:
        """Make everything as it was."""
        self.grid.passes[:], self.grid.open[:] = counts

    def clear(self) -> None:
        """Count nothing."""
        self.grid.passes[:] = 0
        count_open(self.grid)

    @cached_property
    def wanted_m2(self) -> float:
        """What is to be covered."""
        return float(np.count_nonzero(self.grid.wanted)) * self.grid.cell_m**2

    @property
    def missed_m2(self) -> float:
        """What is not covered."""
        return float(self.grid.open.sum()) * self.grid.cell_m**2
