"""Compiled: a raster on which what the tool passes over is counted, cell by cell.

A cell counts as passed over if its middle is. Straights are one quadrilateral, bends one for each step along them.
Blocks of cells know how many of theirs are still to be covered: where none is, nobody needs to look.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import borrowing, kernel
from touchline.services.planner.geometry.clothoid import Floats

# Columns of a table of pieces, as in `Piece`: the curvature is the robot's, the length is driven either way, and a turn
# on the spot comes first.
LENGTH, CURVATURE, SHARPNESS, DIRECTION, SPIN = range(5)
COLUMNS = 5
# Steps along bends (m): where it counts, and where it need be right only within `ROUGH_OFF_M` times the path's length.
BEND_STEP_M, ROUGH_STEP_M = 0.1, 0.4
# For each metre of an arc of radius r a chord cuts off ROUGH_STEP_M²/(12·r) (m): no more than this at the tool's outer
# end, if r is 1.3 m or more there; at the inner end it adds some.
ROUGH_OFF_M = 0.01
# Cells along the side of a block.
BLOCK = 8


# What a step adds to x (m), y (m) and the heading (rad).
Steps = tuple[float, float, float]
Place = tuple[float, float]
# First row, row behind the last one, first column, column behind the last one.
Box = tuple[int, int, int, int]


class PassGrid(NamedTuple):
    """A raster; its first cell's corner is at (x, y).

    Attributes:
        half_width_m: Of the tool that passes over it.
        x_m: Of the corner.
        y_m: Of the corner.
        cell_m: Side of a cell.
        wanted: (rows, columns) whether the cell is to be covered.
        passes: (rows, columns) how many strokes pass over it.
        seen: (rows, columns) the number of the last question that met the cell.
        open: (block rows, block columns) how many cells of each block are wanted and not passed over.
        question: (1,) number of the last question.
        spans: (rows, 2) working space: from where to where a quadrilateral reaches in each row.
    """

    half_width_m: float
    x_m: float
    y_m: float
    cell_m: float
    wanted: NDArray[np.bool_]
    passes: NDArray[np.int16]
    seen: NDArray[np.int32]
    open: NDArray[np.int32]
    question: NDArray[np.int32]
    spans: Floats


@kernel
def fill(edges: Floats, grid: PassGrid, wanted: bool) -> None:
    """Set `wanted` of the cells whose middle is inside closed outlines, by the even-odd rule, row by row.

    Args:
        edges: (n, 4) x₁ y₁ x₂ y₂ (m), of all outlines together.
        grid: Its `wanted` is changed.
        wanted: What it is set to there.
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
def ask(grid: PassGrid) -> None:
    """Begin a new question: cells are met anew."""
    grid.question[0] += 1


@borrowing
def first_from(place: float, count: int) -> int:
    """The first row or column whose middle is not below a place, within 0 … count.

    Args:
        place: In cells, 0 at the middle of the first one.
        count: How many rows or columns there are.
    """
    return min(max(math.ceil(place), 0), count)


@borrowing
def any_open(box: Box, grid: PassGrid) -> bool:
    """Whether any cell is still to be covered in the blocks that touch a box.

    Args:
        box: First row, row behind the last one, first column, column behind the last one.
        grid: What is covered so far.
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
    """Write from where to where a convex quadrilateral reaches along the middles of rows; nowhere: from ∞ to −∞.

    Args:
        corners: (8,) x, y of one corner after the other, in cells, 0 at the middle of the first one.
        box: Of the rows and columns that it meets; see `any_open`.
        grid: Its `spans` are filled in.
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
    """Meet cells of a row; how many of them were wanted and not passed over before.

    Args:
        row: Of the cells.
        first: Column of the first one.
        last: Column behind the last one.
        grid: Its `seen` is changed.
    """
    question, found = grid.question[0], 0
    for column in range(first, last):
        if grid.passes[row, column] == 0 and grid.wanted[row, column] and grid.seen[row, column] != question:
            grid.seen[row, column] = question
            found += 1
    return found


@borrowing
def pass_row(row: int, first: int, last: int, grid: PassGrid, change: int) -> int:
    """Count passes over cells of a row; how many of them were wanted and not passed over before.

    Args:
        row: Of the cells.
        first: Column of the first one.
        last: Column behind the last one.
        grid: Its `passes`, `open` and `seen` are changed.
        change: Added to the passes of those met for the first time in a question.
    """
    question, found = grid.question[0], 0
    for column in range(first, last):
        if grid.seen[row, column] == question:
            continue
        grid.seen[row, column] = question
        before = grid.passes[row, column]
        grid.passes[row, column] = before + change
        if (before == 0 or before + change == 0) and grid.wanted[row, column]:
            found += int(before == 0)
            grid.open[row // BLOCK, column // BLOCK] += int(before + change == 0) - int(before == 0)
    return found


@borrowing
def pass_quad(corners: Floats, grid: PassGrid, change: int) -> int:
    """Meet the cells whose middle is within a convex quadrilateral, each once in a question.

    Args:
        corners: (8,) x, y of one corner after the other, in cells, 0 at the middle of the first one.
        grid: Its `passes`, `open` and `seen` are changed.
        change: Added to the passes of those met for the first time; 0 only asks.

    Returns:
        How many of them were wanted and not passed over before.
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
        # Where rounding is beyond the outermost corner, that counts.
        first, last = max(first_from(left, columns), box[2]), min(first_from(right, columns), box[3])
        if change == 0:
            found += open_in_row(row, first, last, grid)
        else:
            found += pass_row(row, first, last, grid, change)
    return found


@borrowing
def chord(heading: float, curvature: float, sharpness: float, length: float, direction: float) -> Steps:
    """By how much a short stretch of a clothoid moves a pose, integrated by Gauss's rule of two points.

    "NIST Digital Library of Mathematical Functions", sec. 3.5(v).

    Args:
        heading: At the beginning (rad).
        curvature: Of the robot there (1/m).
        sharpness: Its change per metre driven (1/m²).
        length: Driven (m), not negative.
        direction: 1 forward, −1 backward.

    Returns:
        Along x (m), along y (m), turned (rad).
    """
    s = direction * length
    rate = direction * sharpness
    early, late = s * (0.5 - 0.28867513459481287), s * (0.5 + 0.28867513459481287)
    first, last = heading + (curvature + 0.5 * rate * early) * early, heading + (curvature + 0.5 * rate * late) * late
    x, y = 0.5 * s * (math.cos(first) + math.cos(last)), 0.5 * s * (math.sin(first) + math.sin(last))
    return x, y, (curvature + 0.5 * rate * s) * s


@borrowing
def in_cells(x: float, y: float, grid: PassGrid) -> Place:
    """A place in cells, 0 at the middle of the first one.

    Args:
        x: m.
        y: m.
        grid: Whose cells are meant.
    """
    return (x - grid.x_m) / grid.cell_m - 0.5, (y - grid.y_m) / grid.cell_m - 0.5


@kernel
def pass_path(start: Floats, table: Floats, count: int, grid: PassGrid, change: int, step_m: float) -> int:
    """Meet what the tool passes over along pieces of a path; see `pass_quad`.

    Args:
        start: (3,) or longer: x (m), y (m), heading (rad) at the beginning.
        table: (n, COLUMNS) pieces: length (m), curvature (1/m), sharpness (1/m²), direction (±1), turn on the spot
            (rad), in which the tool is not counted as passing over anything.
        count: So many of its rows are driven.
        grid: Its `passes`, `open` and `seen` are changed.
        change: Added to the passes of the cells met for the first time; 0 only asks.
        step_m: Length of the quadrilaterals along bends; no longer than this.

    Returns:
        How many of them were wanted and not passed over before.
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
                # Along an arc every step is the last one, turned.
                dx, dy = cos * dx - sin * dy, sin * dx + cos * dy
            x, y, heading = x + dx, y + dy, heading + turn
            across_x, across_y = cos * across_x - sin * across_y, sin * across_x + cos * across_y
            corners[4], corners[5] = in_cells(x - across_x, y - across_y, grid)
            corners[6], corners[7] = in_cells(x + across_x, y + across_y, grid)
            found += pass_quad(corners, grid, change)
    return found


@kernel
def count_open(grid: PassGrid) -> None:
    """Count anew what is to be covered, block by block.

    Args:
        grid: Its `open` is filled in.
    """
    grid.open[:] = 0
    for row in range(grid.wanted.shape[0]):
        for column in range(grid.wanted.shape[1]):
            if grid.wanted[row, column] and grid.passes[row, column] == 0:
                grid.open[row // BLOCK, column // BLOCK] += 1
