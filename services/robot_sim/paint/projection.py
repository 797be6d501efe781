"""Projection of a tick's paint: the nozzle's path projected on the lines near it, in one kernel."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.records import Record
from touchline.services.robot_sim.paint.cell_grid import Grid, cell_of
from touchline.services.robot_sim.world.body import STEPS, TRACE_EAST, TRACE_NORTH, TRACE_SPRAYING

# Columns of the target table (n, 5): the geometry of `touchline.schemas.curves.Curve`.
_X: Final = 0
_Y: Final = 1
_HEADING: Final = 2
_CURVATURE: Final = 3
_LENGTH: Final = 4

# Columns of the points, one row each: the nozzle at the end of a run of flowing paint, or where a stroke begins.
POINT_X: Final = 0
POINT_Y: Final = 1
POINT_TARGET: Final = 2  # the line that the paint up to here belongs to, −1 for none, `STROKE_BEGINS` for no paint
POINT_LATERAL: Final = 3  # m, left of that line positive
POINT_WIDTH: Final = 4  # share of the spray width that is painted, the same all along a stroke
POINT_COLUMNS: Final = 5
STROKE_BEGINS: Final = -2.0

# Columns of the stretches of lines over which paint lies: (target, from arc length, to arc length).
STRETCH_COLUMNS: Final = 3

MOST_RUNS: Final = STEPS
"""Largest number of runs of evenly flowing paint in a tick; each adds at most two points."""
REACH_M: Final = 0.5
"""Distance beyond which paint belongs to no line."""
_ALIGNED: Final = math.cos(math.radians(45.0))
THIN_M: Final = 0.05
_THIN_TURN: Final = math.cos(math.radians(0.5))
"""Cosine of the largest angle between a chord and the step that continues it; the path has turned by twice as much."""
_CREEP_M: Final = 1e-4
"""Distance in a step of the world (0.1 m/s) below which paint need not follow its line: the robot corrects itself."""

Floats = NDArray[np.float64]


class LedgerState(Record):
    """State of the ledger between ticks."""

    open: bool
    """True if paint flowed up to the end of the last tick."""
    points: int
    settled: int
    """Number of points that will not change; there may be one more, the end of a thinned stroke that continues."""
    stretches: int


class Lines(NamedTuple):
    """Lines to be painted; made once."""

    table: Floats
    """(n, 5) x [m], y [m], heading [rad], curvature [1/m], length [m] of each line's start."""
    grid: Grid
    """Grid of the lines within `REACH_M`."""


class Coverage(NamedTuple):
    """Covered stretches; made once."""

    latest: Floats
    """Newest stretch of each line [m], (n, 2), from > to for none."""
    stretches: Floats
    """Older stretches (at least 3·MOST_RUNS rows per line within reach, STRETCH_COLUMNS), until they are put aside."""
    state: Sequence[LedgerState]
    """State of the ledger, (1,)."""


class PaintArrays(NamedTuple):
    """Arrays of a ledger for `enter`."""

    lines: Lines
    half_width_m: float
    """Half the line width."""
    points: Floats
    """Points (at least 2·MOST_RUNS rows to spare, POINT_COLUMNS)."""
    coverage: Coverage
    thins: bool
    """True if points that a stroke does not need are left out."""


@kernel
def project(x: float, y: float, target: Floats) -> tuple[float, float]:
    """Compute the arc length and lateral offset [m] of a point against a line or arc; left positive, not clamped to it.

    Args:
        x: East, map frame [m].
        y: North, map frame [m].
        target: (5,) row of `Lines.table`.
    """
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
def extent(points: Floats, target: Floats) -> tuple[float, float]:
    """Compute the arc lengths [m] between which points run along a line or arc, beyond its ends and round a circle.

    Args:
        points: (n, 2) east, north, map frame [m].
        target: (5,) row of `Lines.table`.
    """
    turn = 2.0 * math.pi / abs(target[_CURVATURE]) if target[_CURVATURE] != 0.0 else 0.0
    at, _ = project(points[0, 0], points[0, 1], target)
    low = high = at
    for row in range(1, len(points)):
        s, _ = project(points[row, 0], points[row, 1], target)
        if turn > 0.0:
            s += turn * math.floor((at - s) / turn + 0.5)
        at, low, high = s, min(low, s), max(high, s)
    return low, high


@kernel
def _clip(a: float, b: float, limit: float) -> tuple[float, float]:
    """Return the part (from, to) of 0…1 in which a value going linearly from `a` to `b` stays within ±`limit`."""
    if abs(a) <= limit and abs(b) <= limit:
        return 0.0, 1.0
    if a == b:
        return 1.0, 0.0
    first, last = (-limit - a) / (b - a), (limit - a) / (b - a)
    if first > last:
        first, last = last, first
    return max(first, 0.0), min(last, 1.0)


@kernel
def _cover(index: int, low: float, high: float, coverage: Coverage) -> None:
    """Unite a stretch with the latest one of its line, or put that aside and begin anew."""
    latest = coverage.latest[index]
    if low <= latest[1] and latest[0] <= high:
        latest[0], latest[1] = min(latest[0], low), max(latest[1], high)
        return
    if latest[0] <= latest[1]:
        state = coverage.state[0]
        row = coverage.stretches[state.stretches]
        row[0], row[1], row[2] = index, latest[0], latest[1]
        state.stretches += 1
    latest[0], latest[1] = low, high


@kernel
def _hit(
    index: int, lines: Lines, a: tuple[float, float], b: tuple[float, float], limit_m: float, coverage: Coverage
) -> None:
    """Cover the stretch of a line that is near to the chord from `a` to `b`, (arc length, lateral offset)."""
    target = lines.table[index]
    first, last = _clip(a[1], b[1], limit_m)
    if first > last:
        return
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
            _cover(index, low, high, coverage)


@kernel
def cover(lines: Lines, limit_m: float, points: Floats, first: int, coverage: Coverage) -> int:
    """Enter the stretches of lines that strokes pass within `limit_m` of, as `enter` does tick by tick.

    Args:
        lines: Lines that may be covered.
        limit_m: Largest distance from a line.
        points: (n, POINT_COLUMNS) of the strokes.
        first: Index of the point to begin with.
        coverage: Updated.

    Returns:
        Index of the point to continue with once `coverage.stretches` have been taken; n when all is entered.
    """
    grid, room = lines.grid, len(coverage.stretches)
    for row in range(max(first, 1), len(points)):
        if points[row, POINT_TARGET] == STROKE_BEGINS:
            continue
        ax, ay, bx, by = points[row - 1, POINT_X], points[row - 1, POINT_Y], points[row, POINT_X], points[row, POINT_Y]
        cell = cell_of(bx, by, grid.frame)
        if cell < 0:
            continue
        if coverage.state[0].stretches + 3 * (grid.starts[cell + 1] - grid.starts[cell]) > room:
            return row
        for member in range(grid.starts[cell], grid.starts[cell + 1]):
            index = grid.members[member]
            target = lines.table[index]
            s, lateral = project(bx, by, target)
            if abs(lateral) <= REACH_M and -REACH_M <= s <= target[_LENGTH] + REACH_M:
                _hit(index, lines, project(ax, ay, target), (s, lateral), limit_m, coverage)
    return len(points)


@kernel
def _point(trace_row: Floats, target: float, lateral: float, width: float, paint: PaintArrays) -> None:
    state = paint.coverage.state[0]
    row = paint.points[state.points]
    row[POINT_WIDTH] = width
    row[POINT_X], row[POINT_Y] = trace_row[TRACE_EAST], trace_row[TRACE_NORTH]
    row[POINT_TARGET], row[POINT_LATERAL] = target, lateral
    state.points += 1
    state.settled = state.points


@kernel
def _lengthen(x: float, y: float, target: float, paint: PaintArrays) -> None:
    """Make room for the stroke's new end (x, y): remove the last point if the path is straight and short without it."""
    state, points = paint.coverage.state[0], paint.points
    if state.settled < state.points:
        end, before = points[state.points - 1], points[state.points - 2]
        chord_x, chord_y = end[POINT_X] - before[POINT_X], end[POINT_Y] - before[POINT_Y]
        step_x, step_y = x - end[POINT_X], y - end[POINT_Y]
        along = chord_x * step_x + chord_y * step_y
        straight = along >= _THIN_TURN * math.hypot(chord_x, chord_y) * math.hypot(step_x, step_y)
        near = math.hypot(x - before[POINT_X], y - before[POINT_Y]) <= THIN_M
        if straight and near and end[POINT_TARGET] == target:
            state.points -= 1
    state.settled = state.points


@kernel
def enter(trace: Floats, paint: PaintArrays) -> None:
    """Enter a tick: the runs of paint in it, the line each belongs to, and the stretches of lines they cover.

    A stretch is covered where the nozzle passes within half a line's width of the line. A run belongs to the nearest
    line within `REACH_M` that it follows (directions within 45°), up to half a width beyond the line's ends. If it
    creeps, and is not within half a width of any line that it follows, it belongs to the nearest line within that
    distance.

    Args:
        trace: `body.TRACE_SHAPE` of the world's tick, map frame [m].
        paint: Arrays of the ledger; points are appended, the coverage is updated.
    """
    lines, half_width_m, points, coverage, _ = paint
    table, grid, state = lines.table, lines.grid, coverage.state[0]
    row = 1
    while row <= STEPS:
        if trace[row, TRACE_SPRAYING] == 0.0:
            state.open, state.settled = False, state.points
            row += 1
            continue
        first, width = row - 1, trace[row, TRACE_SPRAYING]
        while row < STEPS and trace[row + 1, TRACE_SPRAYING] == width:
            row += 1
        last = row
        row += 1
        ax, ay = trace[first, TRACE_EAST], trace[first, TRACE_NORTH]
        bx, by = trace[last, TRACE_EAST], trace[last, TRACE_NORTH]
        chord = math.hypot(bx - ax, by - ay)
        best, best_lateral = -1, REACH_M
        under, under_lateral = -1, half_width_m if chord < _CREEP_M * (last - first) else 0.0
        cell = cell_of(bx, by, grid.frame)
        for member in range(grid.starts[cell] if cell >= 0 else 0, grid.starts[cell + 1] if cell >= 0 else 0):
            index = grid.members[member]
            target = table[index]
            s, lateral = project(bx, by, target)
            if abs(lateral) > REACH_M or s < -REACH_M or s > target[_LENGTH] + REACH_M:
                continue
            _hit(index, lines, project(ax, ay, target), (s, lateral), half_width_m, coverage)
            if s < -half_width_m or s > target[_LENGTH] + half_width_m:
                continue
            if abs(lateral) < abs(under_lateral):
                under, under_lateral = index, lateral
            if abs(lateral) >= abs(best_lateral):
                continue
            tangent = target[_HEADING] + target[_CURVATURE] * s
            along = (bx - ax) * math.cos(tangent) + (by - ay) * math.sin(tangent)
            if abs(along) >= _ALIGNED * chord:
                best, best_lateral = index, lateral
        if under >= 0 and abs(best_lateral) > half_width_m:
            best, best_lateral = under, under_lateral
        if not state.open or points[state.points - 1, POINT_WIDTH] != width:
            _point(trace[first], STROKE_BEGINS, 0.0, width, paint)
        if paint.thins:
            end = trace[last]
            _lengthen(end[TRACE_EAST], end[TRACE_NORTH], float(best), paint)
        _point(trace[last], float(best), best_lateral, width, paint)
        if paint.thins:
            state.settled -= 1
        state.open = True
