"""Occupancy grid round the robot that fades: what has been seen lately, and where it was free.

It tells whether an outline that the plan knows is missing, so it is kept only where there is one.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import borrowing, kernel
from touchline.onboard.perception.scan import KNOWN, NOTHING, THING, UNUSABLE, Beams

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

CELLS: Final = 128
"""Cells of a side, a power of two."""
_MASK: Final = CELLS - 1
"""Bits of a cell's place in memory: its place on the map modulo CELLS."""
CELL_M: Final = 0.1
REACH_M: Final = CELLS // 2 * CELL_M
"""Reach from the lidar that scanned last to the sides, up to a cell."""
OCCUPIED: Final = 0.85
"""Log-odds that a return adds to its cell, once a scan."""
FREE: Final = -0.4
"""Log-odds that a beam adds to each cell that it passes, once a scan."""
_MOST: Final = 4.0
_HALF_LIFE_S: Final = 30.0
_STRIDE: Final = 8
"""Beams of which one is followed in a scan, each in turn."""


@kernel
def _move(corner: Integers, x: int, y: int, cells: Floats) -> None:
    """Move the grid's lower left corner; cells that come in are unknown.

    Args:
        corner: (2,) corner, cells from the map's origin; changed.
        x: New corner, with `y`.
        y: Its other coordinate.
        cells: (CELLS, CELLS) log-odds, each at its place modulo CELLS.
    """
    if x == corner[0] and y == corner[1]:
        return
    moved_x, moved_y = x - corner[0], y - corner[1]
    first = x + max(CELLS - moved_x, 0) if moved_x > 0 else x
    for i in range(first, first + min(abs(moved_x), CELLS)):
        for j in range(CELLS):
            cells[i & _MASK, j] = 0.0
    first = y + max(CELLS - moved_y, 0) if moved_y > 0 else y
    for j in range(first, first + min(abs(moved_y), CELLS)):
        for i in range(CELLS):
            cells[i, j & _MASK] = 0.0
    corner[0], corner[1] = x, y


@kernel
def _occupy(cells: Floats, marks: Integers, i: int, j: int, scan: int) -> None:
    """Enter a cell as occupied, once a scan."""
    i, j = i & _MASK, j & _MASK
    if marks[i, j] != scan:
        marks[i, j] = scan
        cells[i, j] = min(cells[i, j] + OCCUPIED, _MOST)


@borrowing
def enter_scan(beams: Beams, free_m: float, scan: int, corner: Integers, cells: Floats, marks: Integers) -> None:
    """Enter a scan: returns are occupied, what lies before them is free.

    Args:
        beams: The scan.
        free_m: Range up to which a beam without a return was free.
        scan: Number of the scan.
        corner: (2,) lower left corner, cells from the map's origin; moves with the robot.
        cells: (CELLS, CELLS) log-odds; changed.
        marks: (CELLS, CELLS) number of the last scan that changed each.
    """
    last = beams.rays[len(beams.rays) - 1]
    x, y = math.floor(last[0] / CELL_M) - CELLS // 2, math.floor(last[1] / CELL_M) - CELLS // 2
    _move(corner, x, y, cells)
    for b in range(len(beams.kind)):
        if beams.kind[b] == THING or beams.kind[b] == KNOWN:
            i, j = math.floor(beams.points_m[b, 0] / CELL_M), math.floor(beams.points_m[b, 1] / CELL_M)
            if x <= i < x + CELLS and y <= j < y + CELLS:
                _occupy(cells, marks, i, j, scan)
    for b in range(scan % _STRIDE, len(beams.kind), _STRIDE):
        if beams.kind[b] != UNUSABLE:
            far = free_m if beams.kind[b] == NOTHING else beams.range_m[b] - CELL_M
            _free(beams.rays[b], far, scan, corner, cells, marks)


@kernel
def _free(ray: Floats, far_m: float, scan: int, corner: Integers, cells: Floats, marks: Integers) -> None:
    """Enter the cells along a ray as free, from cell to cell, up to a range or the grid's edge."""
    # From the corner and in cells, so that truncation rounds down.
    x, y = ray[0] / CELL_M - corner[0], ray[1] / CELL_M - corner[1]
    dx, dy, left, low = ray[2], ray[3], corner[0], corner[1]
    steps = far_m / CELL_M
    if dx != 0.0:
        steps = min(steps, ((CELLS if dx > 0.0 else 0.0) - x) / dx)
    if dy != 0.0:
        steps = min(steps, ((CELLS if dy > 0.0 else 0.0) - y) / dy)
    for _ in range(int(steps)):
        i, j = (int(x) + left) & _MASK, (int(y) + low) & _MASK
        odds = cells[i, j] + (FREE if marks[i, j] != scan else 0.0)
        cells[i, j] = odds if odds > -_MOST else -_MOST
        marks[i, j] = scan
        x, y = x + dx, y + dy


@borrowing
def fade(cells: Floats, after_s: float) -> None:
    """Let all log-odds fade for this time.

    Args:
        cells: (CELLS, CELLS) log-odds; changed.
        after_s: Time since they faded last.
    """
    share = 0.5 ** (after_s / _HALF_LIFE_S)
    for i in range(CELLS):
        for j in range(CELLS):
            cells[i, j] *= share


class FadingGrid:
    """Log-odds of occupancy in cells of 10 cm, up to 6.4 m from the lidar that scanned last.

    Attributes:
        corner: (2,) lower left corner, cells from the map's origin.
        cells: (CELLS, CELLS) log-odds, east by north; each cell is at its place on the map modulo CELLS.
    """

    def __init__(self) -> None:
        self.corner, self.cells = np.zeros(2, np.int64), np.zeros((CELLS, CELLS))
        self._marks, self._scans, self._faded_s = np.zeros((CELLS, CELLS), np.int64), 0, -math.inf
        self._blank = True

    def enter(self, beams: Beams, free_m: float, time_s: float, *, asked: bool = True) -> None:
        """Enter a scan.

        Args:
            beams: The scan, with its kinds.
            free_m: Range up to which a beam without a return was free.
            time_s: Present time.
            asked: False if the grid is of no use here: it then forgets everything.
        """
        if time_s - self._faded_s >= 1.0:
            if not self._blank:
                fade(self.cells, time_s - self._faded_s)
            self._faded_s = time_s
        self._scans += 1
        if not asked:
            if not self._blank:
                self.cells.fill(0.0)
            self._blank = True
            return
        self._blank = False
        enter_scan(beams, free_m, self._scans, self.corner, self.cells, self._marks)

    @property
    def log_odds(self) -> Floats:
        """(CELLS, CELLS) log-odds, east by north, from the lower left corner; positive: occupied."""
        x, y = self.corner % CELLS
        return np.roll(self.cells, (-x, -y), (0, 1))
