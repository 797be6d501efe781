"""Where a tick's paint fell: the nozzle's path projected on every line that should be painted, in one kernel."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from schemas.jit import kernel
from services.robot_sim.world.body import STEPS, TRACE_EAST, TRACE_NORTH, TRACE_SPRAYING

# Columns of the target table (n, 5): the geometry of `schemas.curves.Curve`.
_X: Final = 0
_Y: Final = 1
_HEADING: Final = 2
_CURVATURE: Final = 3
_LENGTH: Final = 4

# Columns of the runs: a run is an unbroken stretch of flowing paint within one tick.
RUN_FIRST_ROW: Final = 0  # of the trace: where paint began to flow
RUN_LAST_ROW: Final = 1
RUN_TARGET: Final = 2  # the line that this paint belongs to, −1 for none
RUN_ARC_LENGTH: Final = 3  # m, along that line
RUN_LATERAL: Final = 4  # m, left of that line positive
RUN_SHAPE: Final = (STEPS, 5)

# Columns of the hits: (target, from arc length, to arc length).
HIT_COLUMNS: Final = 3

REACH_M: Final = 0.5
"""Paint further than this from every line belongs to none of them."""
_ALIGNED: Final = math.cos(math.radians(45.0))


@kernel
def project(x: float, y: float, target: NDArray[np.float64]) -> tuple[float, float]:
    """(arc length, lateral offset) [m] of a point against a line or arc (5,); left positive, not clamped to it."""
    curvature = target[_CURVATURE]
    cos, sin = math.cos(target[_HEADING]), math.sin(target[_HEADING])
    dx, dy = x - target[_X], y - target[_Y]
    if curvature == 0.0:
        return dx * cos + dy * sin, dy * cos - dx * sin
    radius, side = 1.0 / abs(curvature), math.copysign(1.0, curvature)
    from_centre_x, from_centre_y = dx + sin * side * radius, dy - cos * side * radius
    lateral = side * (radius - math.hypot(from_centre_x, from_centre_y))
    swept = side * (math.atan2(from_centre_y, from_centre_x) - (target[_HEADING] - side * 0.5 * math.pi))
    middle = 0.5 * target[_LENGTH] / radius
    swept -= 2.0 * math.pi * math.floor((swept - middle + math.pi) / (2.0 * math.pi))
    return swept * radius, lateral


@kernel
def _clip(a: float, b: float, limit: float) -> tuple[float, float]:
    """The part (from, to) of 0…1 in which a value going linearly from `a` to `b` stays within ±`limit`."""
    if abs(a) <= limit and abs(b) <= limit:
        return 0.0, 1.0
    if a == b:
        return 1.0, 0.0
    first, last = (-limit - a) / (b - a), (limit - a) / (b - a)
    if first > last:
        first, last = last, first
    return max(first, 0.0), min(last, 1.0)


@kernel
def _hit(
    index: int,
    target: NDArray[np.float64],
    a: tuple[float, float],
    b: tuple[float, float],
    half_width: float,
    hits: NDArray[np.float64],
    count: int,
) -> int:
    first, last = _clip(a[1], b[1], half_width)
    if first > last:
        return count
    length, travel = target[_LENGTH], b[0] - a[0]
    if target[_CURVATURE] != 0.0 and abs(travel) > 0.5 * 2.0 * math.pi / abs(target[_CURVATURE]):
        # The chord passes the point opposite the arc's middle: only on a full circle is there paint on both sides.
        travel -= math.copysign(2.0 * math.pi / abs(target[_CURVATURE]), travel)
    begin, end = a[0] + first * travel, a[0] + last * travel
    if begin > end:
        begin, end = end, begin
    turn = 2.0 * math.pi / abs(target[_CURVATURE]) if target[_CURVATURE] != 0.0 else 0.0
    for shift in range(-1, 2):
        if shift != 0 and turn == 0.0:
            continue
        low, high = max(begin + shift * turn, 0.0), min(end + shift * turn, length)
        if low < high:
            hits[count, 0], hits[count, 1], hits[count, 2] = index, low, high
            count += 1
    return count


@kernel
def mark(
    targets: NDArray[np.float64],
    half_width: float,
    trace: NDArray[np.float64],
    runs: NDArray[np.float64],
    hits: NDArray[np.float64],
) -> tuple[int, int]:
    """Find the runs of paint in a tick, the line each belongs to, and the stretches of lines they cover.

    A stretch is covered where the nozzle passes within `half_width` of the line. A run belongs to the nearest line
    within `REACH_M` that it follows (directions within 45°), up to `half_width` beyond the line's ends.

    Args:
        targets: (n, 5) x [m], y [m], heading [rad], curvature [1/m], length [m] of each line's start.
        half_width: Half the line width [m].
        trace: (STEPS + 1, 3) of the world's tick.
        runs: (STEPS, 5) filled, see the RUN columns.
        hits: (at least 3·n·STEPS, 3) filled with (target, from, to).

    Returns:
        Number of runs, number of hits.
    """
    run_count, hit_count, row = 0, 0, 1
    while row <= STEPS:
        if trace[row, TRACE_SPRAYING] == 0.0:
            row += 1
            continue
        first = row - 1
        while row < STEPS and trace[row + 1, TRACE_SPRAYING] > 0.0:
            row += 1
        last = row
        row += 1
        ax, ay = trace[first, TRACE_EAST], trace[first, TRACE_NORTH]
        bx, by = trace[last, TRACE_EAST], trace[last, TRACE_NORTH]
        chord = math.hypot(bx - ax, by - ay)
        best, best_s, best_lateral = -1, 0.0, REACH_M
        for index in range(targets.shape[0]):
            target = targets[index]
            s, lateral = project(bx, by, target)
            if abs(lateral) > REACH_M or s < -REACH_M or s > target[_LENGTH] + REACH_M:
                continue
            hit_count = _hit(index, target, project(ax, ay, target), (s, lateral), half_width, hits, hit_count)
            if abs(lateral) >= abs(best_lateral) or s < -half_width or s > target[_LENGTH] + half_width:
                continue
            tangent = target[_HEADING] + target[_CURVATURE] * s
            along = (bx - ax) * math.cos(tangent) + (by - ay) * math.sin(tangent)
            if abs(along) >= _ALIGNED * chord:
                best, best_s, best_lateral = index, s, lateral
        runs[run_count, RUN_FIRST_ROW], runs[run_count, RUN_LAST_ROW] = first, last
        runs[run_count, RUN_TARGET], runs[run_count, RUN_ARC_LENGTH] = best, best_s
        runs[run_count, RUN_LATERAL] = best_lateral
        run_count += 1
    return run_count, hit_count
