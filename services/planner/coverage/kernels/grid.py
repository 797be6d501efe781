"""Compiled: raster that counts the passes of the tool over each cell.

A cell counts as passed over if its centre is. Straights are one quadrilateral, bends one for each step along them.
Blocks of cells hold the number of cells still to be covered, so that finished blocks are skipped.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import borrowing, kernel
from touchline.services.planner.geometry.clothoid import Floats

# Columns of a table of pieces, as in `Piece`: the curvature is the robot's, the length is positive in both directions,
# and a turn on the spot comes first.
LENGTH, CURVATURE, SHARPNESS, DIRECTION, SPIN = range(5)
COLUMNS = 5
# Steps along bends (m): exact, and rough, with an error below `ROUGH_OFF_M` times the path's length.
BEND_STEP_M, ROUGH_STEP_M = 0.1, 0.4
# Per metre of an arc of radius r a chord cuts off ROUGH_STEP_M²/(12·r) (m): at most this at the tool's outer end, if r
# is at least 1.3 m there; at the inner end it adds some.
ROUGH_OFF_M = 0.01
# Cells along the side of a block.
BLOCK = 8


# Increments of x (m), y (m) and the heading (rad) in a step.
Steps = tuple[float, float, float]
Place = tuple[float, float]
# First row, row after the last one, first column, column after the last one.
Box = tuple[int, int, int, int]


class PassGrid(NamedTuple):
    """A raster; its first cell's corner is at (x, y).

    Attributes:
        half_width_m: Half the width of the tool.
        x_m: x of the corner.
        y_m: y of the corner.
        cell_m: Side of a cell.
        wanted: (rows, columns) whether the cell is to be covered.
        passes: (rows, columns) number of strokes that pass over the cell.
        seen: (rows, columns) number of the last query that met the cell.
        open: (block rows, block columns) number of cells of each block that are wanted and not passed over.
        query: (1,) number of the last query.
        spans: (rows, 2) working space: interval of a quadrilateral in each row.
    """

    half_width_m: float
    x_m: float
    y_m: float
    cell_m: float
    wanted: NDArray[np.bool_]
    passes: NDArray[np.int16]
    seen: NDArray[np.int32]
    open: NDArray[np.int32]
    query: NDArray[np.int32]
    spans: Floats


@kernel
def fill(edges: Floats, grid: PassGrid, wanted: bool) -> None:
    """Set `wanted` of the cells whose centre is inside closed outlines, by the even-odd rule, row by row.

    Args:
        edges: (n, 4) x₁ y₁ x₂ y₂ (m), of all outlines together.
        grid: Raster; its `wanted` is changed.
        wanted: New value.
    """
    rows, columns = grid.wanted.shape
    crossings = np.empty(len(edges))
    for row in range(rows):
        y, count = grid.y_m + (row + 0.5) * grid.cell_m, 0
        for e in range(len(edges)):
            if (edges[e, 1] > y) != (edges[e, 3] > y):
                share = (y - edges[e, 1]) / (edges[e, 3] - edges[e, 1])
                crossings[count] = edges[e, 0] + share * (edges[e, 2] - edges[e, 0])
                count += 1
        crossings[:count].sort()
        for k in range(0, count - 1, 2):
            first = max(math.ceil((crossings[k] - grid.x_m) / grid.cell_m - 0.5), 0)
            last = min(math.ceil((crossings[k + 1] - grid.x_m) / grid.cell_m - 0.5), columns)
            for column in range(first, last):
                grid.wanted[row, column] = wanted


@borrowing
def begin_query(grid: PassGrid) -> None:
    """Begin a new query, in which each cell is met once."""
    grid.query[0] += 1


@borrowing
def first_from(place: float, count: int) -> int:
    """First row or column whose centre is not below a position, within 0 … count.

    Args:
        place: Position in cells, 0 at the centre of the first one.
        count: Number of rows or columns.
    """
    return min(max(math.ceil(place), 0), count)


@borrowing
def any_open(box: Box, grid: PassGrid) -> bool:
    """True if any cell is still to be covered in the blocks that touch a box.

    Args:
        box: First row, row after the last one, first column, column after the last one.
        grid: Raster.
    """
    if box[0] >= box[1] or box[2] >= box[3]:
        return False
    for row in range(box[0] // BLOCK, (box[1] - 1) // BLOCK + 1):
        for column in range(box[2] // BLOCK, (box[3] - 1) // BLOCK + 1):
            if grid.open[row, column] > 0:
                return True
    return False


@borrowing
def lay_spans(corners: Floats, box: Box, grid: PassGrid) -> None:
    """Write the intervals of a convex quadrilateral along the centre lines of rows; empty ones are (∞, −∞).

    Args:
        corners: (8,) x, y of one corner after the other, in cells, 0 at the centre of the first one.
        box: Rows and columns that it meets; see `any_open`.
        grid: Raster; its `spans` are filled in.
    """
    spans = grid.spans
    for row in range(box[0], box[1]):
        spans[row, 0], spans[row, 1] = math.inf, -math.inf
    for k in range(4):
        ax, ay = corners[2 * k], corners[2 * k + 1]
        bx, by = corners[(2 * k + 2) % 8], corners[(2 * k + 3) % 8]
        slope = (bx - ax) / (by - ay) if by != ay else 0.0
        for row in range(first_from(min(ay, by), box[1]), first_from(max(ay, by), box[1])):
            x = ax + (row - ay) * slope
            spans[row, 0], spans[row, 1] = min(spans[row, 0], x), max(spans[row, 1], x)


@borrowing
def open_in_row(row: int, first: int, last: int, grid: PassGrid) -> int:
    """Meet cells of a row, and return the number of those wanted and not passed over before.

    Args:
        row: Row of the cells.
        first: First column.
        last: Column after the last one.
        grid: Raster; its `seen` is changed.
    """
    query, found = grid.query[0], 0
    for column in range(first, last):
        if grid.passes[row, column] == 0 and grid.wanted[row, column] and grid.seen[row, column] != query:
            grid.seen[row, column] = query
            found += 1
    return found


@borrowing
def pass_row(row: int, first: int, last: int, grid: PassGrid, change: int) -> int:
    """Count passes over cells of a row, and return the number of those wanted and not passed over before.

    Args:
        row: Row of the cells.
        first: First column.
        last: Column after the last one.
        grid: Raster; its `passes`, `open` and `seen` are changed.
        change: Added to the passes of cells met for the first time in a query.
    """
    query, found = grid.query[0], 0
    for column in range(first, last):
        if grid.seen[row, column] == query:
            continue
        grid.seen[row, column] = query
        before = grid.passes[row, column]
        grid.passes[row, column] = before + change
        if (before == 0 or before + change == 0) and grid.wanted[row, column]:
            found += int(before == 0)
            grid.open[row // BLOCK, column // BLOCK] += int(before + change == 0) - int(before == 0)
    return found


@borrowing
def pass_quad(corners: Floats, grid: PassGrid, change: int) -> int:
    """Meet the cells whose centre is within a convex quadrilateral, each once in a query.

    Args:
        corners: (8,) x, y of one corner after the other, in cells, 0 at the centre of the first one.
        grid: Raster; its `passes`, `open` and `seen` are changed.
        change: Added to the passes of cells met for the first time; 0 only queries.

    Returns:
        Number of cells that were wanted and not passed over before.
    """
    rows, columns = grid.wanted.shape
    box = (
        first_from(min(corners[1], corners[3], corners[5], corners[7]), rows),
        first_from(max(corners[1], corners[3], corners[5], corners[7]), rows),
        first_from(min(corners[0], corners[2], corners[4], corners[6]), columns),
        first_from(max(corners[0], corners[2], corners[4], corners[6]), columns),
    )
    if change == 0 and not any_open(box, grid):
        return 0
    lay_spans(corners, box, grid)
    found = 0
    for row in range(box[0], box[1]):
        left, right = grid.spans[row, 0], grid.spans[row, 1]
        if left > right:
            continue
        # Rounding does not reach beyond the outermost corner.
        first, last = max(first_from(left, columns), box[2]), min(first_from(right, columns), box[3])
        if change == 0:
            found += open_in_row(row, first, last, grid)
        else:
            found += pass_row(row, first, last, grid, change)
    return found


@borrowing
def chord(heading: float, curvature: float, sharpness: float, length: float, direction: float) -> Steps:
    """Motion along a short stretch of a clothoid, integrated by Gauss's rule with two points.

    "NIST Digital Library of Mathematical Functions", sec. 3.5(v).

    Args:
        heading: Heading at the beginning (rad).
        curvature: Curvature of the robot there (1/m).
        sharpness: Change of curvature per metre driven (1/m²).
        length: Driven length (m), not negative.
        direction: 1 forward, −1 backward.

    Returns:
        Increments of x (m), y (m) and the heading (rad).
    """
    s = direction * length
    rate = direction * sharpness
    early, late = s * (0.5 - 0.28867513459481287), s * (0.5 + 0.28867513459481287)
    first, last = heading + (curvature + 0.5 * rate * early) * early, heading + (curvature + 0.5 * rate * late) * late
    x, y = 0.5 * s * (math.cos(first) + math.cos(last)), 0.5 * s * (math.sin(first) + math.sin(last))
    return x, y, (curvature + 0.5 * rate * s) * s


@borrowing
def in_cells(x: float, y: float, grid: PassGrid) -> Place:
    """Convert a point to cells, 0 at the centre of the first one.

    Args:
        x: x in the frame of the raster (m).
        y: y in the frame of the raster (m).
        grid: Raster.
    """
    return (x - grid.x_m) / grid.cell_m - 0.5, (y - grid.y_m) / grid.cell_m - 0.5


@kernel
def pass_path(start: Floats, table: Floats, count: int, grid: PassGrid, change: int, step_m: float) -> int:
    """Meet the cells that the tool passes over along pieces of a path; see `pass_quad`.

    Args:
        start: (3,) or longer: x (m), y (m), heading (rad) at the beginning.
        table: (n, COLUMNS) pieces: length (m), curvature (1/m), sharpness (1/m²), direction (±1), turn on the spot
            (rad), in which the tool is not counted as passing over anything.
        count: Number of rows that are driven.
        grid: Raster; its `passes`, `open` and `seen` are changed.
        change: Added to the passes of cells met for the first time; 0 only queries.
        step_m: Maximum length of the quadrilaterals along bends.

    Returns:
        Number of cells that were wanted and not passed over before.
    """
    corners, found = np.empty(8), 0
    x, y, heading = start[0], start[1], start[2]
    across_x, across_y = -grid.half_width_m * math.sin(heading), grid.half_width_m * math.cos(heading)
    for k in range(count):
        length, direction = table[k, LENGTH], table[k, DIRECTION]
        if table[k, SPIN] != 0.0:
            heading += table[k, SPIN]
            across_x, across_y = -grid.half_width_m * math.sin(heading), grid.half_width_m * math.cos(heading)
            if length == 0.0:
                continue
        curvature, sharpness = table[k, CURVATURE], table[k, SHARPNESS]
        bent = curvature != 0.0 or sharpness != 0.0
        steps = max(1, math.ceil(length / step_m)) if bent else 1
        step, dx, dy, turn, cos, sin = length / steps, 0.0, 0.0, 0.0, 1.0, 0.0
        for n in range(steps):
            corners[0], corners[1] = in_cells(x + across_x, y + across_y, grid)
            corners[2], corners[3] = in_cells(x - across_x, y - across_y, grid)
            if n == 0 or sharpness != 0.0:
                dx, dy, turn = chord(heading, curvature, sharpness, step, direction)
                curvature += sharpness * step
                cos, sin = math.cos(turn), math.sin(turn)
            else:
                # Along an arc every step is the previous one, rotated.
                dx, dy = cos * dx - sin * dy, sin * dx + cos * dy
            x, y, heading = x + dx, y + dy, heading + turn
            across_x, across_y = cos * across_x - sin * across_y, sin * across_x + cos * across_y
            corners[4], corners[5] = in_cells(x - across_x, y - across_y, grid)
            corners[6], corners[7] = in_cells(x + across_x, y + across_y, grid)
            found += pass_quad(corners, grid, change)
    return found


@kernel
def count_open(grid: PassGrid) -> None:
    """Count the open cells of each block.

    Args:
        grid: Raster; its `open` is filled in.
    """
    grid.open[:] = 0
    for row in range(grid.wanted.shape[0]):
        for column in range(grid.wanted.shape[1]):
            if grid.wanted[row, column] and grid.passes[row, column] == 0:
                grid.open[row // BLOCK, column // BLOCK] += 1
