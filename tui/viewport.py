"""Viewport of the map: pan, zoom and fit, and conversion between metres and braille dots."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

DOTS_X = 2
"""Number of braille dots across a cell."""
DOTS_Y = 4
"""Number of braille dots down a cell."""
CELL_ASPECT = 2.0
"""Ratio of height to width of a terminal cell, unless the terminal reports another."""

MIN_DOT_M = 0.002
MAX_DOT_M = 50.0


@dataclass(frozen=True)
class Viewport:
    """Window on the field. `center_*_m` is the field point in the middle; y points north (up).

    `dot_m` is the width of one braille dot in metres; its height is `dot_m * dot_aspect`, so that a metre is as long
    upwards as sideways on the screen.
    """

    columns: int
    rows: int
    center_x_m: float = 0.0
    center_y_m: float = 0.0
    dot_m: float = 1.0
    cell_aspect: float = CELL_ASPECT

    @property
    def width(self) -> int:
        """Number of dots across."""
        return self.columns * DOTS_X

    @property
    def height(self) -> int:
        """Number of dots down."""
        return self.rows * DOTS_Y

    @property
    def dot_height_m(self) -> float:
        """Height of a dot (m)."""
        return self.dot_m * self.cell_aspect * DOTS_X / DOTS_Y

    @property
    def cell_m(self) -> float:
        """Width of a cell (m)."""
        return self.dot_m * DOTS_X

    def to_dots(
        self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Convert field points (n,) (m) to dots (n,), u to the right and v down, (0, 0) the top left corner."""
        u = (x_m - self.center_x_m) / self.dot_m + self.width / 2
        v = (self.center_y_m - y_m) / self.dot_height_m + self.height / 2
        return u, v

    def to_cell(self, x_m: float, y_m: float) -> tuple[int, int] | None:
        """Cell (column, row) of a field point; None if it is outside or not finite."""
        u = (x_m - self.center_x_m) / self.dot_m + self.width / 2
        v = (self.center_y_m - y_m) / self.dot_height_m + self.height / 2
        if not (0 <= u < self.width and 0 <= v < self.height):
            return None
        return int(u) // DOTS_X, int(v) // DOTS_Y

    def to_field(self, column: float, row: float) -> tuple[float, float]:
        """Field point (m) at a cell position; whole numbers are cell corners, +0.5 is the middle."""
        x = self.center_x_m + (column * DOTS_X - self.width / 2) * self.dot_m
        y = self.center_y_m - (row * DOTS_Y - self.height / 2) * self.dot_height_m
        return x, y

    def panned(self, columns: float, rows: float) -> Viewport:
        """Pan right by `columns` cells and down by `rows` cells."""
        return replace(
            self,
            center_x_m=self.center_x_m + columns * DOTS_X * self.dot_m,
            center_y_m=self.center_y_m - rows * DOTS_Y * self.dot_height_m,
        )

    def zoomed(self, factor: float, column: float | None = None, row: float | None = None) -> Viewport:
        """Magnify by `factor` about a cell (column, row) (default: the middle)."""
        column = self.columns / 2 if column is None else column
        row = self.rows / 2 if row is None else row
        x, y = self.to_field(column, row)
        dot = min(max(self.dot_m / factor, MIN_DOT_M), MAX_DOT_M)
        scale = dot / self.dot_m
        return replace(
            self,
            dot_m=dot,
            center_x_m=x + (self.center_x_m - x) * scale,
            center_y_m=y + (self.center_y_m - y) * scale,
        )

    def resized(self, columns: int, rows: int) -> Viewport:
        """Change the number of cells, with the same centre and scale."""
        return replace(self, columns=max(columns, 1), rows=max(rows, 1))

    def centered(self, x_m: float, y_m: float) -> Viewport:
        """Centre a field point, to the nearest whole cell, so that the map does not shimmer."""
        width_m, height_m = self.cell_m, self.dot_height_m * DOTS_Y
        return replace(self, center_x_m=round(x_m / width_m) * width_m, center_y_m=round(y_m / height_m) * height_m)

    def fitted(self, bounds: tuple[float, float, float, float], margin: float = 0.06) -> Viewport:
        """Show all of `bounds` (x_min, y_min, x_max, y_max) in metres with a margin as a fraction of the size."""
        x_min, y_min, x_max, y_max = bounds
        width_m = max(x_max - x_min, 1e-6) * (1 + 2 * margin)
        height_m = max(y_max - y_min, 1e-6) * (1 + 2 * margin)
        aspect = self.cell_aspect * DOTS_X / DOTS_Y
        dot = max(width_m / self.width, height_m / self.height / aspect)
        return replace(
            self,
            dot_m=min(max(dot, MIN_DOT_M), MAX_DOT_M),
            center_x_m=(x_min + x_max) / 2,
            center_y_m=(y_min + y_max) / 2,
        )


def round_step_m(most_m: float) -> float:
    """Maximum of 1, 2 or 5 times a power of ten metres up to `most_m`."""
    power = 10.0 ** math.floor(math.log10(most_m) + 1e-9)
    return max(power * factor for factor in (1, 2, 5) if power * factor <= most_m * (1 + 1e-9))
