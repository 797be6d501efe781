"""Compiled: search for the best transition from one straight stroke to another, by time and by covered ground.

The score is the seconds less the price of the ground that only the zones and the word cover.
"""

import math

import numpy as np

from touchline.core.jit import kernel
from touchline.services.planner.coverage.kernels.grid import (
    BEND_STEP_M,
    COLUMNS,
    DIRECTION,
    LENGTH,
    ROUGH_OFF_M,
    ROUGH_STEP_M,
    PassGrid,
    begin_query,
    pass_path,
)
from touchline.services.planner.coverage.kernels.transition_candidates import (
    OFF,
    ONTO,
    Candidates,
    Join,
    Room,
    arrival,
    departure,
    lay_word,
    list_candidates,
    slide_table,
)
from touchline.services.planner.coverage.kernels.turn_pieces import KINDS, WORD_PIECES, Mover, along
from touchline.services.planner.coverage.kernels.wall_clearance import Walls, keeps_off, poses_along, stands_free
from touchline.services.planner.geometry.clothoid import Floats, Ints

# The search ends after this many candidates that all touch something.
HOPELESS = 2500
MOST_POSES = 4000


@kernel
def _leave_cells(join: Join, i: int, grid: PassGrid) -> int:
    """Newly met cells of the driven part of the first stroke's end zone."""
    cells = _zone_cells(join.leaving, join.leave[i, 0], join.leaving_direction, grid)
    if join.leave[i, 2] != 0.0 and join.leave[i, 3] != 0.0:
        start = along(join.leaving, join.leaving_direction, join.leave[i, 0])
        cells += pass_path(start, slide_table(join, join.leave[i], OFF), 4, grid, 0, BEND_STEP_M)
    return int(cells)


@kernel
def _join_cells(join: Join, j: int, grid: PassGrid) -> int:
    """Newly met cells of the driven part of the second stroke's begin zone."""
    from_m = join.join[j, 1]
    begun = along(join.joining, join.joining_direction, from_m)
    cells = _zone_cells(begun, join.zone_m - from_m, join.joining_direction, grid)
    if join.join[j, 2] != 0.0 and join.join[j, 3] != 0.0:
        cells += pass_path(arrival(join, j), slide_table(join, join.join[j], ONTO), 4, grid, 0, BEND_STEP_M)
    return int(cells)


@kernel
def _zone_cells(begin: Floats, length_m: float, direction: float, grid: PassGrid) -> int:
    """Newly met cells of a straight from a pose (3,)."""
    line = np.zeros((1, COLUMNS))
    line[0, LENGTH], line[0, DIRECTION] = length_m, direction
    return int(pass_path(begin, line, 1, grid, 0, BEND_STEP_M))


@kernel
def is_free(join: Join, i: int, count: int, walls: Walls, room: Room) -> bool:
    """True if the body touches nothing on the word in `room.table`.

    Args:
        join: Zones of the two strokes.
        i: Row of `leave`.
        count: Number of pieces of the word.
        walls: Outlines that the body keeps off.
        room: Working space; caches `stands`.
    """
    start = departure(join, i)
    if room.stands[i] < 0:
        room.stands[i] = 1 if stands_free(start, walls) else 0
    if room.stands[i] == 0:
        return False
    room.poses[0], length = start, 1
    # Ends of pieces first: nearly all words that touch something do so at one of them.
    for k in range(count):
        ahead = room.poses[length - 1 :]
        length += poses_along(ahead[0], room.table[k : k + 1], 1, ahead) - 1
        if not keeps_off(room.poses[length - 1 : length], walls):
            return False
    return bool(keeps_off(room.poses[:length], walls))


@kernel
def zone_cells(join: Join, candidate: Ints, grid: PassGrid, room: Room) -> int:
    """Cells that only the zones of a candidate pass over; cells of both count twice.

    Args:
        join: Zones of the two strokes.
        candidate: (4,) a row of `Candidates.which`.
        grid: Raster; its `passes` stay as they are.
        room: Working space; caches `leave_cells` and `join_cells`.
    """
    i, j = candidate[0], candidate[1]
    if room.leave_cells[i] < 0:
        begin_query(grid)
        room.leave_cells[i] = _leave_cells(join, i, grid)
    if room.join_cells[j] < 0:
        begin_query(grid)
        room.join_cells[j] = _join_cells(join, j, grid)
    return int(room.leave_cells[i] + room.join_cells[j])


@kernel
def cells_gained(join: Join, candidate: Ints, count: int, enough: float, grid: PassGrid, room: Room) -> int:
    """Cells that only a candidate and its zones pass over.

    Args:
        join: Zones of the two strokes.
        candidate: (4,) a row of `Candidates.which`.
        count: Number of pieces of its word in `room.table`.
        enough: Number of cells below which the exact count does not matter.
        grid: Raster; its `passes` stay as they are.
        room: Working space, with the word.

    Returns:
        Number of cells; −1 if below `enough`.
    """
    alone, start = zone_cells(join, candidate, grid, room), departure(join, candidate[0])
    off = ROUGH_OFF_M * room.table[:count, LENGTH].sum() / grid.cell_m**2
    begin_query(grid)
    if pass_path(start, room.table, count, grid, 0, ROUGH_STEP_M) + off + alone < enough:
        return -1
    begin_query(grid)
    gained = pass_path(start, room.table, count, grid, 0, BEND_STEP_M)
    if gained + alone < enough:
        return -1
    gained += _leave_cells(join, candidate[0], grid)
    return int(gained + _join_cells(join, candidate[1], grid))


@kernel
def survey(join: Join, walls: Walls, mover: Mover, grid: PassGrid, seconds_per_m2: float, patience: int) -> Floats:
    """Find the best transition from one stroke to another.

    Candidates are examined in the order of their rough score, until `patience` free ones in a row are no better, or,
    while none is free, until `HOPELESS` were tried. Gained cells are counted only where they may be enough.

    Args:
        join: Zones of the two strokes.
        walls: Outlines that the body keeps off.
        mover: Motion of the machine.
        grid: Passes of all other strokes.
        seconds_per_m2: Price of a square metre that nothing else covers.
        patience: Number of free candidates in a row without improvement that ends the search.

    Returns:
        (8,) score (s), seconds, m² gained, row of `leave`, row of `join`, direction (±1), kind (row of `Room.amounts`),
        and first deflection (rad). The score is infinite if there is none.
    """
    leaves, joins = len(join.leave), len(join.join)
    most = leaves * joins * 2 * KINDS
    room = Room(
        np.empty((KINDS, 3)),
        np.zeros((WORD_PIECES, COLUMNS)),
        np.empty((MOST_POSES, 3)),
        np.empty(5),
        np.empty(5),
        np.full(leaves, -1),
        np.full(leaves, -1),
        np.full(joins, -1),
    )
    candidates = Candidates(np.empty(most), np.empty(most), np.empty((most, 4), np.int64))
    found = list_candidates(join, walls, mover, room, candidates)
    best = np.full(8, math.inf)
    cell = grid.cell_m * grid.cell_m
    tried = since = 0
    for k in np.argsort(candidates.rough[:found]):
        if since >= patience or (math.isinf(best[0]) and tried >= HOPELESS):
            break
        tried += 1
        candidate = candidates.which[k]
        count = lay_word(join, candidate, mover, room)
        if not is_free(join, candidate[0], count, walls, room):
            continue
        since += 1
        # One cell less makes up for rounding.
        enough = (candidates.times[k] - best[0]) / (seconds_per_m2 * cell) - 1.0
        gained = cells_gained(join, candidate, count, enough, grid, room)
        score = candidates.times[k] - seconds_per_m2 * gained * cell
        if gained >= 0 and score < best[0]:
            since = 0
            best[0], best[1], best[2], best[3], best[4] = (
                score,
                candidates.times[k],
                gained * cell,
                candidate[0],
                candidate[1],
            )
            best[5], best[6], best[7] = -1.0 if candidate[2] else 1.0, candidate[3], room.amounts[candidate[3], 0]
    return best
