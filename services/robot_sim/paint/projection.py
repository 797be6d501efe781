"""Where a tick's paint fell: the nozzle's path projected on the lines near it, in one kernel."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.jit import kernel
from touchline.services.robot_sim.paint.cell_grid import cell_of
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

# State of the ledger between ticks.
STATE_OPEN: Final = 0  # whether paint flowed up to the end of the last tick
STATE_POINTS: Final = 1
STATE_STRETCHES: Final = 2
STATE_SIZE: Final = 3

MOST_RUNS: Final = STEPS
"""Of evenly flowing paint in a tick; each adds at most two points."""
REACH_M: Final = 0.5
"""Paint further than this from every line belongs to none of them."""
_ALIGNED: Final = math.cos(math.radians(45.0))
_CREEP_M: Final = 1e-4
"""Paint that moves by less in a step of the world (0.1 m/s) need not go along its line: the robot corrects itself."""


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
def extent(points: NDArray[np.float64], target: NDArray[np.float64]) -> tuple[float, float]:
    """Arc lengths between which points (n, 2) run along a line or arc (5,), beyond its ends and round a circle."""
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
def _cover(
    index: int,
    low: float,
    high: float,
    latest: NDArray[np.float64],
    stretches: NDArray[np.float64],
    state: NDArray[np.int64],
) -> None:
    """Unite a stretch with the latest one of its line, or put that aside and begin anew."""
    if low <= latest[index, 1] and latest[index, 0] <= high:
        latest[index, 0], latest[index, 1] = min(latest[index, 0], low), max(latest[index, 1], high)
        return
    if latest[index, 0] <= latest[index, 1]:
        row = state[STATE_STRETCHES]
        stretches[row, 0], stretches[row, 1], stretches[row, 2] = index, latest[index, 0], latest[index, 1]
        state[STATE_STRETCHES] = row + 1
    latest[index, 0], latest[index, 1] = low, high


@kernel
def _hit(
    index: int,
    target: NDArray[np.float64],
    a: tuple[float, float],
    b: tuple[float, float],
    half_width: float,
    latest: NDArray[np.float64],
    stretches: NDArray[np.float64],
    state: NDArray[np.int64],
) -> None:
    first, last = _clip(a[1], b[1], half_width)
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
            _cover(index, low, high, latest, stretches, state)


@kernel
def cover(
    targets: NDArray[np.float64],
    frame: NDArray[np.float64],
    starts: NDArray[np.int64],
    members: NDArray[np.int64],
    limit_m: float,
    points: NDArray[np.float64],
    first: int,
    latest: NDArray[np.float64],
    stretches: NDArray[np.float64],
    state: NDArray[np.int64],
) -> int:
    """Enter the stretches of lines that strokes pass within `limit_m` of, as `enter` does tick by tick.

    Args:
        targets: As `frame`, `starts`, `members`, `latest`, `stretches` and `state`, of `enter`.
        frame: See `targets`.
        starts: See `targets`.
        members: See `targets`.
        limit_m: How far off a line.
        points: (n, POINT_COLUMNS) of the strokes.
        first: Of the points, the one to begin with.
        latest: See `targets`.
        stretches: See `targets`.
        state: See `targets`.

    Returns:
        The point to go on with once `stretches` have been taken; n when all is entered.
    """
    for row in range(max(first, 1), len(points)):
        if points[row, POINT_TARGET] == STROKE_BEGINS:
            continue
        ax, ay, bx, by = points[row - 1, POINT_X], points[row - 1, POINT_Y], points[row, POINT_X], points[row, POINT_Y]
        cell = cell_of(bx, by, frame)
        if cell < 0:
            continue
        if state[STATE_STRETCHES] + 3 * (starts[cell + 1] - starts[cell]) > len(stretches):
            return row
        for member in range(starts[cell], starts[cell + 1]):
            target = targets[members[member]]
            s, lateral = project(bx, by, target)
            if abs(lateral) <= REACH_M and -REACH_M <= s <= target[_LENGTH] + REACH_M:
                a = project(ax, ay, target)
                _hit(members[member], target, a, (s, lateral), limit_m, latest, stretches, state)
    return len(points)


@kernel
def _point(
    row: NDArray[np.float64],
    target: float,
    lateral: float,
    width: float,
    points: NDArray[np.float64],
    state: NDArray[np.int64],
) -> None:
    at = state[STATE_POINTS]
    points[at, POINT_WIDTH] = width
    points[at, POINT_X], points[at, POINT_Y] = row[TRACE_EAST], row[TRACE_NORTH]
    points[at, POINT_TARGET], points[at, POINT_LATERAL] = target, lateral
    state[STATE_POINTS] = at + 1


@kernel
def enter(
    targets: NDArray[np.float64],
    frame: NDArray[np.float64],
    starts: NDArray[np.int64],
    members: NDArray[np.int64],
    half_width: float,
    trace: NDArray[np.float64],
    points: NDArray[np.float64],
    latest: NDArray[np.float64],
    stretches: NDArray[np.float64],
    state: NDArray[np.int64],
) -> None:
    """Enter a tick: the runs of paint in it, the line each belongs to, and the stretches of lines they cover.

    A stretch is covered where the nozzle passes within `half_width` of the line. A run belongs to the nearest line
    within `REACH_M` that it follows (directions within 45°), up to `half_width` beyond the line's ends. If it
    creeps, and lies within `half_width` of none that it follows, it belongs to the nearest line within that.

    Args:
        targets: (n, 5) x [m], y [m], heading [rad], curvature [1/m], length [m] of each line's start.
        frame: As `starts` and `members`, of the `Grid` of the lines.
        starts: See `frame`.
        members: See `frame`.
        half_width: Half the line width [m].
        trace: (STEPS + 1, 3) of the world's tick.
        points: (at least 2·MOST_RUNS rows to spare, POINT_COLUMNS) appended to.
        latest: (n, 2) the newest stretch of each line, from > to for none; updated.
        stretches: (at least 3·MOST_RUNS rows per line within reach, STRETCH_COLUMNS) older ones, appended to.
        state: (STATE_SIZE,) updated.
    """
    row = 1
    while row <= STEPS:
        if trace[row, TRACE_SPRAYING] == 0.0:
            state[STATE_OPEN] = 0
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
        under, under_lateral = -1, half_width if chord < _CREEP_M * (last - first) else 0.0
        cell = cell_of(bx, by, frame)
        for member in range(starts[cell] if cell >= 0 else 0, starts[cell + 1] if cell >= 0 else 0):
            index = members[member]
            target = targets[index]
            s, lateral = project(bx, by, target)
            if abs(lateral) > REACH_M or s < -REACH_M or s > target[_LENGTH] + REACH_M:
                continue
            _hit(index, target, project(ax, ay, target), (s, lateral), half_width, latest, stretches, state)
            if s < -half_width or s > target[_LENGTH] + half_width:
                continue
            if abs(lateral) < abs(under_lateral):
                under, under_lateral = index, lateral
            if abs(lateral) >= abs(best_lateral):
                continue
            tangent = target[_HEADING] + target[_CURVATURE] * s
            along = (bx - ax) * math.cos(tangent) + (by - ay) * math.sin(tangent)
            if abs(along) >= _ALIGNED * chord:
                best, best_lateral = index, lateral
        if under >= 0 and abs(best_lateral) > half_width:
            best, best_lateral = under, under_lateral
        if state[STATE_OPEN] == 0 or points[state[STATE_POINTS] - 1, POINT_WIDTH] != width:
            _point(trace[first], STROKE_BEGINS, 0.0, width, points, state)
        _point(trace[last], float(best), best_lateral, width, points, state)
        state[STATE_OPEN] = 1
