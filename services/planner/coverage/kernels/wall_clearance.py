"""Compiled: clearance of the body from walls along a path.

A body well off everything may move that far before the next check, so most poses along a path are never checked: the
conservative advancement of Mirtich, "Impulse-based Dynamic Simulation of Rigid Body
Systems", PhD thesis, University of California, Berkeley, 1996, ch. 2, from place to place.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import borrowing, kernel
from touchline.core.polygons import apart_squared, off_squared
from touchline.services.planner.collision.checker import first_touch
from touchline.services.planner.coverage.kernels.grid import CURVATURE, DIRECTION, LENGTH, SHARPNESS, SPIN, chord
from touchline.services.planner.geometry.clothoid import Floats, Ints

# Sampling of the body along a word (m).
BODY_STEP_M = 0.12
# Sampling of the body in turns on the spot (rad).
SPIN_STEP_RAD = 0.05
# Clearances are exact up to this distance (m).
MEASURED_M = 1.0
# Error of measured clearances (m).
ROUNDING_M = 1e-9
# Least cells (m) of the grid in which edges near a body are found, and their largest number, roughly.
CELL_M, MOST_CELLS = 1.0, 20_000.0

Complexes = NDArray[np.complex128]


class EdgeCells(NamedTuple):
    """Edges near each square cell of the ground.

    Attributes:
        x_m, y_m: South-west corner of the grid.
        cell_m: Width of a cell.
        columns: Number of cells from west to east.
        begins: (cells + 1,) where the edges of each cell begin in `near`, row by row from south to north.
        near: Numbers of edges, in order: those within `MEASURED_M` of a body whose origin is in the cell, and others.
        off_m: (cells,) distance of all edges from the cell, at least.
    """

    x_m: float
    y_m: float
    cell_m: float
    columns: int
    begins: Ints
    near: Ints
    off_m: Floats


class Walls(NamedTuple):
    """Outlines (see collision/checker.py) that a body, which reaches `reach_m` from its origin, keeps off."""

    edges: Floats
    owner: Ints
    body: Floats
    margin_m: float
    reach_m: float
    cells: EdgeCells


def edge_cells(edges: Floats, reach_m: float) -> EdgeCells:
    """Sort edges into a grid.

    Args:
        edges: (n, 4) x₁ y₁ x₂ y₂, m.
        reach_m: Distance that the body reaches from its origin.
    """
    ends = edges.reshape(-1, 2)
    low, high = ends.min(axis=0), ends.max(axis=0)
    (x_m, y_m), cell_m = low.tolist(), max(CELL_M, math.sqrt(float(np.prod(high - low)) / MOST_CELLS))
    columns, rows = (int(cells) for cells in np.ceil((high - low) / cell_m) + 1.0)
    near, off_m = near_edges(edges, (x_m, y_m, cell_m), (columns, rows), reach_m + MEASURED_M)
    begins = np.concatenate((np.zeros(1, dtype=np.int64), np.cumsum(near.sum(axis=1))))
    return EdgeCells(x_m, y_m, cell_m, columns, begins, np.nonzero(near)[1], off_m)


@kernel
def near_edges(
    edges: Floats, grid: tuple[float, float, float], size: tuple[int, int], far_m: float
) -> tuple[NDArray[np.bool_], Floats]:
    """Find which edges (cells, n) may be within a distance of a point in each cell, and the least distance (cells,).

    Args:
        edges: (n, 4) x₁ y₁ x₂ y₂, m.
        grid: South-west corner of the grid, and width of a cell.
        size: Number of columns and of rows.
        far_m: The distance.
    """
    (x_m, y_m, cell_m), (columns, rows) = grid, size
    near, off_m = np.zeros((columns * rows, len(edges)), np.bool_), np.full(columns * rows, math.inf)
    half_m = math.sqrt(0.5) * cell_m + ROUNDING_M
    for cell in range(columns * rows):
        middle = complex(x_m + (cell % columns + 0.5) * cell_m, y_m + (cell // columns + 0.5) * cell_m)
        for e in range(len(edges)):
            a, b = complex(edges[e, 0], edges[e, 1]), complex(edges[e, 2], edges[e, 3])
            off = math.sqrt(off_squared(middle, a, b)) - half_m
            off_m[cell] = min(off_m[cell], off)
            near[cell, e] = off < far_m
    return near, off_m


@borrowing
def poses_along(start: Floats, table: Floats, count: int, poses: Floats) -> int:
    """Write poses along pieces, close enough for checks of the body.

    Args:
        start: (3,) x (m), y (m), heading (rad) at the beginning.
        table: (n, COLUMNS) pieces; see `pass_path`.
        count: Number of rows that are driven.
        poses: (m, 3) filled in, `start` first, as far as there is room.

    Returns:
        Number of poses filled in.
    """
    x, y, heading, n = start[0], start[1], start[2], 1
    poses[0, 0], poses[0, 1], poses[0, 2] = x, y, heading
    for k in range(count):
        if table[k, SPIN] != 0.0:
            parts = math.ceil(abs(table[k, SPIN]) / SPIN_STEP_RAD)
            for _ in range(parts):
                heading += table[k, SPIN] / parts
                if n < len(poses):
                    poses[n, 0], poses[n, 1], poses[n, 2] = x, y, heading
                    n += 1
            if table[k, LENGTH] == 0.0:
                continue
        steps = max(1, math.ceil(table[k, LENGTH] / BODY_STEP_M))
        step, curvature, sharpness = table[k, LENGTH] / steps, table[k, CURVATURE], table[k, SHARPNESS]
        dx, dy, turn, cos, sin = 0.0, 0.0, 0.0, 1.0, 0.0
        for i in range(steps):
            if i == 0 or sharpness != 0.0:
                dx, dy, turn = chord(heading, curvature, sharpness, step, table[k, DIRECTION])
                curvature += sharpness * step
                if sharpness == 0.0 and turn != 0.0:
                    cos, sin = math.cos(turn), math.sin(turn)
            else:
                # Along an arc every step is the previous one, rotated.
                dx, dy = cos * dx - sin * dy, sin * dx + cos * dy
            x, y, heading = x + dx, y + dy, heading + turn
            if n < len(poses):
                poses[n, 0], poses[n, 1], poses[n, 2] = x, y, heading
                n += 1
    return int(n)


@borrowing
def off_walls(pose: Floats, walls: Walls, corners: Complexes) -> float:
    """Distance of the body from the walls (m); beyond `MEASURED_M` a lower bound of it.

    Args:
        pose: (3,) x (m), y (m), heading (rad).
        walls: Outlines that the body keeps off.
        corners: (body's corners + 1,) working space.
    """
    cells = walls.cells
    column, row = math.floor((pose[0] - cells.x_m) / cells.cell_m), math.floor((pose[1] - cells.y_m) / cells.cell_m)
    cell = row * cells.columns + column
    inside = 0 <= column < cells.columns and 0 <= cell < len(cells.off_m)
    if inside and cells.off_m[cell] >= walls.reach_m + MEASURED_M:
        bound: float = cells.off_m[cell] - walls.reach_m
        return bound
    first, end = (cells.begins[cell], cells.begins[cell + 1]) if inside else (0, len(walls.edges))
    cos, sin, sides = math.cos(pose[2]), math.sin(pose[2]), len(walls.body)
    middle, placed, least = complex(pose[0], pose[1]), False, MEASURED_M if inside else math.inf
    for k in range(first, end):
        e = cells.near[k] if inside else k
        a, b = complex(walls.edges[e, 0], walls.edges[e, 1]), complex(walls.edges[e, 2], walls.edges[e, 3])
        # No point of the body is nearer than this.
        off = math.sqrt(off_squared(middle, a, b)) - walls.reach_m
        if off >= MEASURED_M or off >= least:
            least = min(least, off)
            continue
        if not placed:
            placed = True
            for c in range(sides + 1):
                x, y = walls.body[c % sides, 0], walls.body[c % sides, 1]
                corners[c] = complex(pose[0] + cos * x - sin * y, pose[1] + sin * x + cos * y)
        for c in range(sides):
            least = min(least, math.sqrt(apart_squared(corners[c], corners[c + 1], a, b)))
    return least


@kernel
def stands_free(pose: Floats, walls: Walls) -> bool:
    """True if the body keeps off the walls at a pose and is on their right side.

    Args:
        pose: (3,) x (m), y (m), heading (rad).
        walls: Outlines that the body keeps off.
    """
    return bool(first_touch(np.expand_dims(pose, 0), walls.edges, walls.owner, True, walls.body, walls.margin_m)[0] < 0)


@kernel
def keeps_off(poses: Floats, walls: Walls) -> bool:
    """True if the body keeps off the walls along a path; the first pose is taken to be on their right side.

    Args:
        poses: (n, 3) x (m), y (m), heading (rad), in driving order.
        walls: Outlines that the body keeps off.
    """
    corners, p = np.empty(len(walls.body) + 1, np.complex128), 0
    while p < len(poses):
        spare = off_walls(poses[p], walls, corners) - walls.margin_m
        if spare < 0.0:
            return False
        moved, p = 0.0, p + 1
        while p < len(poses):
            x, y = poses[p, 0] - poses[p - 1, 0], poses[p, 1] - poses[p - 1, 1]
            moved += math.sqrt(x * x + y * y) + abs(poses[p, 2] - poses[p - 1, 2]) * walls.reach_m + ROUNDING_M
            if moved > spare:
                break
            p += 1
    return True
