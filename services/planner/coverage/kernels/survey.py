"""Compiled: the best way from one straight stroke to another, by time and by what it leaves uncovered.

What counts is seconds less what the zones and the word pass over that nothing else does, at so many seconds a square
metre.
"""

import math

import numpy as np

from touchline.core.jit import kernel
from touchline.services.planner.coverage.kernels.body_room import Walls, keeps_off, poses_along, stands_free
from touchline.services.planner.coverage.kernels.grid import (
    BEND_STEP_M,
    COLUMNS,
    DIRECTION,
    LENGTH,
    ROUGH_OFF_M,
    ROUGH_STEP_M,
    PassGrid,
    ask,
    pass_path,
)
from touchline.services.planner.coverage.kernels.stroke_ways import (
    OFF,
    ONTO,
    Join,
    Room,
    Ways,
    arrival,
    departure,
    lay_word,
    list_ways,
    slide_table,
)
from touchline.services.planner.coverage.kernels.turn_words import KINDS, WORD_PIECES, Mover, along
from touchline.services.planner.geometry.clothoid import Floats, Ints

# Where so many ways touch something there is none.
HOPELESS = 2500
MOST_POSES = 4000


@kernel
def _left_cells(join: Join, i: int, grid: PassGrid) -> int:
    """Cells of the first stroke's end zone, as far as it is driven, that nothing passed over in this question."""
    cells = _zone_cells(join.leaving, join.leave[i, 0], join.leaving_direction, grid)
    if join.leave[i, 2] != 0.0 and join.leave[i, 3] != 0.0:
        start = along(join.leaving, join.leaving_direction, join.leave[i, 0])
        cells += pass_path(start, slide_table(join, join.leave[i], OFF), 4, grid, 0, BEND_STEP_M)
    return int(cells)


@kernel
def _joined_cells(join: Join, j: int, grid: PassGrid) -> int:
    """Cells of the second stroke's begin zone, as far as it is driven, that nothing passed over in this question."""
    from_m = join.join[j, 1]
    begun = along(join.joining, join.joining_direction, from_m)
    cells = _zone_cells(begun, join.zone_m - from_m, join.joining_direction, grid)
    if join.join[j, 2] != 0.0 and join.join[j, 3] != 0.0:
        cells += pass_path(arrival(join, j), slide_table(join, join.join[j], ONTO), 4, grid, 0, BEND_STEP_M)
    return int(cells)


@kernel
def _zone_cells(begin: Floats, length_m: float, direction: float, grid: PassGrid) -> int:
    """Cells of a straight from a pose (3,) on that nothing passed over in this question."""
    line = np.zeros((1, COLUMNS))
    line[0, LENGTH], line[0, DIRECTION] = length_m, direction
    return int(pass_path(begin, line, 1, grid, 0, BEND_STEP_M))


@kernel
def is_free(join: Join, i: int, count: int, walls: Walls, room: Room) -> bool:
    """Whether the body touches nothing on the word in `room.table`.

    Args:
        join: Zones of the two strokes.
        i: Row of `leave`.
        count: So many pieces the word has.
        walls: What the body keeps off.
        room: Its `poses` are filled in, and its `stands`, which is asked first.
    """
    start = departure(join, i)
    if room.stands[i] < 0:
        room.stands[i] = 1 if stands_free(start, walls) else 0
    if room.stands[i] == 0:
        return False
    length = poses_along(start, room.table, count, room.poses)
    return bool(keeps_off(room.poses[:length], walls))


@kernel
def cells_of_zones(join: Join, way: Ints, grid: PassGrid, room: Room) -> int:
    """Cells that only the zones of a way pass over, those twice that both do.

    Args:
        join: Zones of the two strokes.
        way: (4,) a row of `Ways.which`.
        grid: Asked new questions; its `passes` stay.
        room: Its `left` and `joined` are filled in.
    """
    i, j = way[0], way[1]
    if room.left[i] < 0:
        ask(grid)
        room.left[i] = _left_cells(join, i, grid)
    if room.joined[j] < 0:
        ask(grid)
        room.joined[j] = _joined_cells(join, j, grid)
    return int(room.left[i] + room.joined[j])


@kernel
def cells_gained(join: Join, way: Ints, count: int, enough: float, grid: PassGrid, room: Room) -> int:
    """Cells that only a way and its zones pass over.

    Args:
        join: Zones of the two strokes.
        way: (4,) a row of `Ways.which`.
        count: So many pieces in `room.table` are its word.
        enough: Fewer cells need not be counted.
        grid: Asked new questions; its `passes` stay.
        room: Holds the word.

    Returns:
        Their number; −1 if it is less than `enough`.
    """
    alone, start = cells_of_zones(join, way, grid, room), departure(join, way[0])
    off = ROUGH_OFF_M * room.table[:count, LENGTH].sum() / grid.cell_m**2
    ask(grid)
    if pass_path(start, room.table, count, grid, 0, ROUGH_STEP_M) + off + alone < enough:
        return -1
    ask(grid)
    gained = pass_path(start, room.table, count, grid, 0, BEND_STEP_M)
    if gained + alone < enough:
        return -1
    gained += _left_cells(join, way[0], grid)
    return int(gained + _joined_cells(join, way[1], grid))


@kernel
def survey(join: Join, walls: Walls, mover: Mover, grid: PassGrid, seconds_per_m2: float, patience: int) -> Floats:
    """The best way from one stroke to another.

    Ways are looked at in the order of a rough score, until `patience` free ones in turn were no better;
    or, while none was free, until `HOPELESS` were tried. What a way gains is counted only where it may be enough.

    Args:
        join: Zones of the two strokes.
        walls: What the body keeps off.
        mover: How the machine moves.
        grid: What all other strokes pass over.
        seconds_per_m2: What a square metre is worth that nothing else covers.
        patience: How many free ways in turn may be no better.

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
    ways = Ways(np.empty(most), np.empty(most), np.empty((most, 4), np.int64))
    found = list_ways(join, walls, mover, room, ways)
    best = np.full(8, math.inf)
    cell = grid.cell_m * grid.cell_m
    tried = since = 0
    for k in np.argsort(ways.rough[:found]):
        if since >= patience or (math.isinf(best[0]) and tried >= HOPELESS):
            break
        tried += 1
        way = ways.which[k]
        count = lay_word(join, way, mover, room)
        if not is_free(join, way[0], count, walls, room):
            continue
        since += 1
        # One cell less makes up for rounding.
        enough = (ways.times[k] - best[0]) / (seconds_per_m2 * cell) - 1.0
        gained = cells_gained(join, way, count, enough, grid, room)
        score = ways.times[k] - seconds_per_m2 * gained * cell
        if gained >= 0 and score < best[0]:
            since = 0
            best[0], best[1], best[2], best[3], best[4] = score, ways.times[k], gained * cell, way[0], way[1]
            best[5], best[6], best[7] = -1.0 if way[2] else 1.0, way[3], room.amounts[way[3], 0]
    return best
