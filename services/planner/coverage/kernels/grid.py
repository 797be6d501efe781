"""Compiled: a raster on which what the tool passes over is counted, cell by cell.

A cell counts as passed over if its middle is. Straights are one quadrilateral, bends one for each tenth of a metre.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.jit import kernel
from touchline.services.planner.geometry.clothoid import Floats

# Columns of a table of pieces; as in `Piece`, the curvature is the robot's and the length is driven either way.
LENGTH, CURVATURE, SHARPNESS, DIRECTION = range(4)
BEND_STEP_M = 0.1


class PassGrid(NamedTuple):
    """A raster; its first cell's corner is at (x, y).

    Attributes:
        x_m: Of the corner.
        y_m: Of the corner.
        cell_m: Side of a cell.
        wanted: (rows, columns) whether the cell is to be covered.
        passes: (rows, columns) how many strokes pass over it.
        seen: (rows, columns) the number of the last question that met the cell.
        question: (1,) number of the last question.
    """

    x_m: float
    y_m: float
    cell_m: float
    wanted: NDArray[np.bool_]
    passes: NDArray[np.int16]
    seen: NDArray[np.int32]
    question: NDArray[np.int32]


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


@kernel
def ask(grid: PassGrid) -> None:
    """Begin a new question: cells are met anew."""
    grid.question[0] += 1


@kernel
def pass_quad(corners: Floats, grid: PassGrid, change: int) -> int:
    """Meet the cells whose middle is within a convex quadrilateral, each once in a question.

    Args:
        corners: (8,) x, y (m) of one corner after the other.
        grid: Its `passes` and `seen` are changed.
        change: Added to the passes of those met for the first time.

    Returns:
        How many of them were wanted and not passed over before.
    """
    rows, columns = grid.wanted.shape
    low = min(corners[1], corners[3], corners[5], corners[7])
    high = max(corners[1], corners[3], corners[5], corners[7])
    first_row = max(math.ceil((low - grid.y_m) / grid.cell_m - 0.5), 0)
    last_row = min(math.ceil((high - grid.y_m) / grid.cell_m - 0.5), rows)
    question, found = grid.question[0], 0
    for row in range(first_row, last_row):
        y = grid.y_m + (row + 0.5) * grid.cell_m
        left, right = math.inf, -math.inf
        for k in range(4):
            ax, ay = corners[2 * k], corners[2 * k + 1]
            bx, by = corners[(2 * k + 2) % 8], corners[(2 * k + 3) % 8]
            if (ay > y) != (by > y):
                x = ax + (y - ay) / (by - ay) * (bx - ax)
                left, right = min(left, x), max(right, x)
        if left > right:
            continue
        first = max(math.ceil((left - grid.x_m) / grid.cell_m - 0.5), 0)
        last = min(math.ceil((right - grid.x_m) / grid.cell_m - 0.5), columns)
        for column in range(first, last):
            if grid.seen[row, column] != question:
                grid.seen[row, column] = question
                if grid.passes[row, column] == 0 and grid.wanted[row, column]:
                    found += 1
                grid.passes[row, column] += change
    return found


@kernel
def step_on(pose: Floats, curvature: float, sharpness: float, length: float, direction: float) -> float:
    """Move a pose on by a short stretch of a clothoid, integrated by Gauss's rule of two points.

    "NIST Digital Library of Mathematical Functions", sec. 3.5(v).

    Args:
        pose: (7,) x (m), y (m), heading (rad), updated; the rest is working space.
        curvature: Of the robot at the beginning (1/m).
        sharpness: Its change per metre driven (1/m²).
        length: Driven (m), not negative.
        direction: 1 forward, −1 backward.

    Returns:
        The curvature at the end (1/m).
    """
    s = direction * length
    rate = direction * sharpness
    for k in range(2):
        at = s * (0.5 - 0.28867513459481287 if k == 0 else 0.5 + 0.28867513459481287)
        heading = pose[2] + (curvature + 0.5 * rate * at) * at
        pose[3 + 2 * k], pose[4 + 2 * k] = math.cos(heading), math.sin(heading)
    pose[0] += 0.5 * s * (pose[3] + pose[5])
    pose[1] += 0.5 * s * (pose[4] + pose[6])
    pose[2] += (curvature + 0.5 * rate * s) * s
    return curvature + sharpness * length


@kernel
def pass_path(start: Floats, table: Floats, count: int, half_width: float, grid: PassGrid, change: int) -> int:
    """Meet what the tool passes over along pieces of a path; see `pass_quad`.

    Args:
        start: (3,) or longer: x (m), y (m), heading (rad) at the beginning.
        table: (n, 4) pieces: length (m), curvature (1/m), sharpness (1/m²), direction (±1).
        count: So many of its rows are driven.
        half_width: Of the tool (m).
        grid: Its `passes` and `seen` are changed.
        change: Added to the passes of the cells met for the first time.

    Returns:
        How many of them were wanted and not passed over before.
    """
    pose, corners, found = np.empty(7), np.empty(8), 0
    pose[:3] = start[:3]
    for k in range(count):
        length, curvature = table[k, LENGTH], table[k, CURVATURE]
        bent = curvature != 0.0 or table[k, SHARPNESS] != 0.0
        steps = max(1, math.ceil(length / BEND_STEP_M)) if bent else 1
        for _ in range(steps):
            across_x, across_y = -half_width * math.sin(pose[2]), half_width * math.cos(pose[2])
            corners[0], corners[1] = pose[0] + across_x, pose[1] + across_y
            corners[2], corners[3] = pose[0] - across_x, pose[1] - across_y
            curvature = step_on(pose, curvature, table[k, SHARPNESS], length / steps, table[k, DIRECTION])
            across_x, across_y = -half_width * math.sin(pose[2]), half_width * math.cos(pose[2])
            corners[4], corners[5] = pose[0] - across_x, pose[1] - across_y
            corners[6], corners[7] = pose[0] + across_x, pose[1] + across_y
            found += pass_quad(corners, grid, change)
    return found


@kernel
def uncovered(grid: PassGrid) -> int:
    """How many cells are wanted and not passed over."""
    count = 0
    for row in range(grid.wanted.shape[0]):
        for column in range(grid.wanted.shape[1]):
            if grid.wanted[row, column] and grid.passes[row, column] == 0:
                count += 1
    return count
