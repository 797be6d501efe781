"""Compiled: the best way from one straight stroke to another, by time and by what it leaves uncovered.

A stroke may be left anywhere along its end zone, and the next one joined anywhere along its begin zone; or the zone is
driven to its end and the machine goes back, which takes a cusp. In between lies one of the eight words of turning
circles (circles.py), forward or backward. What counts is seconds less what the zones and the word pass over that
nothing else does, at so many seconds a square metre.
"""

import math
from typing import NamedTuple

import numpy as np

from touchline.services.core.jit import kernel
from touchline.services.planner.collision.checker import first_touch
from touchline.services.planner.coverage.kernels.grid import (
    CURVATURE,
    DIRECTION,
    LENGTH,
    SHARPNESS,
    PassGrid,
    ask,
    pass_path,
    step_on,
)
from touchline.services.planner.geometry.clothoid import Floats, Ints
from touchline.services.planner.steering.circles import LIMIT, LIMIT_TURN, turn_length, word_table

# The body is looked at this often (m) along a word.
BODY_STEP_M = 0.12
# So many pieces make a word: three turns of three.
WORD_PIECES = 9
# Longer words wind round themselves to no purpose: so many turning radii, beside the straight distance.
LONGEST_RADII = 12.0
# Roughly, driving a zone further is worth so many times the seconds that it takes.
WORKED_MORE = 2.5
# Where so many ways touch something there is none.
HOPELESS = 2500
MOST_POSES = 4000


class Walls(NamedTuple):
    """Outlines that the body keeps off (see collision/checker.py) by `margin_m`."""

    edges: Floats
    owner: Ints
    body: Floats
    margin_m: float


class Mover(NamedTuple):
    """How the machine moves: figures of its turning circle at unit sharpness, √sharpness, speed, acceleration."""

    circle: Floats
    root: float
    half_width_m: float
    speed_mps: float
    acceleration_mps2: float


class Join(NamedTuple):
    """Zones of two strokes and where they may be left and joined; lengths (m) along the direction of travel.

    Attributes:
        leaving: (3,) pose at the beginning of the first stroke's end zone.
        leaving_direction: ±1.
        leave: (n, 3) how far the zone is driven, how far straight back from there, and to which side a slide follows
            (±1, 0: none).
        slide: (4, 4) pieces of the slide to the left, on the way back.
        slid: (2,) where it ends, seen from where it begins.
        joining: (3,) pose at the beginning of the second stroke's begin zone.
        joining_direction: ±1.
        zone_m: Length of the begin zone.
        join: (m, 2) where the word ends, and from where on the zone is driven: the same, or before it.
        cusps: Whether the machine may go back on a zone.
        backward: Whether words may be driven backward.
    """

    leaving: Floats
    leaving_direction: float
    leave: Floats
    slide: Floats
    slid: Floats
    joining: Floats
    joining_direction: float
    zone_m: float
    join: Floats
    cusps: bool
    backward: bool


@kernel
def turn_rows(deflection: float, direction: float, mover: Mover, table: Floats, row: int) -> int:
    """Write the pieces of a turn by a signed deflection (rad) of the direction of travel; the next free row."""
    c, root, size = mover.circle, mover.root, abs(deflection)
    # What turns the direction of travel to the left turns a robot that drives backward with negative curvature.
    side = direction * (1.0 if deflection >= 0.0 else -1.0)
    if size == 0.0:
        table[row, LENGTH], table[row, CURVATURE] = turn_length(0.0, c) / root, 0.0
        table[row, SHARPNESS], table[row, DIRECTION] = 0.0, direction
        return row + 1
    if size < c[LIMIT_TURN]:
        half = 0.5 * turn_length(size, c)
        peak, hold = size / half, 0.0
    else:
        half, peak = c[LIMIT], c[LIMIT]
        hold = (size - c[LIMIT_TURN]) / c[LIMIT]
    sharpness = side * peak / half * root * root
    for k in range(3):
        if k == 1 and hold <= 0.0:
            continue
        table[row, LENGTH] = (hold if k == 1 else half) / root
        table[row, CURVATURE] = 0.0 if k == 0 else side * peak * root
        table[row, SHARPNESS] = sharpness if k == 0 else (0.0 if k == 1 else -sharpness)
        table[row, DIRECTION] = direction
        row += 1
    return row


@kernel
def word_rows(amounts: Floats, kind: int, direction: float, mover: Mover, table: Floats) -> int:
    """Write the pieces of a word of `word_table`, driven one way; how many they are."""
    row = turn_rows(amounts[0], direction, mover, table, 0)
    if kind % 4 < 2:
        table[row, LENGTH], table[row, CURVATURE] = amounts[1] / mover.root, 0.0
        table[row, SHARPNESS], table[row, DIRECTION] = 0.0, direction
        row += 1
    else:
        row = turn_rows(amounts[1], direction, mover, table, row)
    return int(turn_rows(amounts[2], direction, mover, table, row))


@kernel
def word_m(amounts: Floats, kind: int, mover: Mover) -> float:
    """Length of a word (m); infinite if there is none."""
    if not math.isfinite(amounts[1]):
        return math.inf
    turning = turn_length(abs(amounts[0]), mover.circle) + turn_length(abs(amounts[2]), mover.circle)
    middle = amounts[1] if kind % 4 < 2 else turn_length(abs(amounts[1]), mover.circle)
    return float((turning + middle) / mover.root)


@kernel
def poses_along(start: Floats, table: Floats, count: int, poses: Floats) -> int:
    """Poses along pieces, close enough to look at the body; how many."""
    pose, n = np.empty(7), 1
    pose[:3] = start[:3]
    poses[0] = start[:3]
    for k in range(count):
        steps = max(1, math.ceil(table[k, LENGTH] / BODY_STEP_M))
        curvature = table[k, CURVATURE]
        for _ in range(steps):
            curvature = step_on(pose, curvature, table[k, SHARPNESS], table[k, LENGTH] / steps, table[k, DIRECTION])
            if n < len(poses):
                poses[n] = pose[:3]
                n += 1
    return int(n)


@kernel
def along(pose: Floats, direction: float, length: float) -> Floats:
    """The pose (3,) after a straight (m) in the direction of travel."""
    moved = np.empty(3)
    moved[0] = pose[0] + direction * length * math.cos(pose[2])
    moved[1] = pose[1] + direction * length * math.sin(pose[2])
    moved[2] = pose[2]
    return moved


@kernel
def run_s(length: float, mover: Mover, standstills: int) -> float:
    """As `CoverageMachine.run_s`."""
    if standstills == 2 and length < mover.speed_mps**2 / mover.acceleration_mps2:
        return 2.0 * math.sqrt(length / mover.acceleration_mps2)
    return length / mover.speed_mps + 0.5 * standstills * mover.speed_mps / mover.acceleration_mps2


@kernel
def way_s(driven: Floats, heading_to: Floats, mover: Mover) -> float:
    """Seconds for stretches (m) in directions (±1, 0: none); the first and the last are entered and left at speed."""
    total, length, direction, standstills = 0.0, 0.0, heading_to[0], 0
    for k in range(len(driven)):
        if driven[k] <= 0.0:
            continue
        if heading_to[k] != direction:
            total += run_s(length, mover, standstills + 1)
            length, direction, standstills = 0.0, heading_to[k], 1
        length += driven[k]
    return float(total + run_s(length, mover, standstills))


@kernel
def departure(join: Join, i: int) -> Floats:
    """The pose (3,) at which the word begins for row `i` of `leave`."""
    pose: Floats = along(join.leaving, join.leaving_direction, join.leave[i, 0] - join.leave[i, 1])
    if join.leave[i, 2] != 0.0:
        x, y, c, s = join.slid[0], join.leave[i, 2] * join.slid[1], math.cos(pose[2]), math.sin(pose[2])
        pose[0] += c * x - s * y
        pose[1] += s * x + c * y
    return pose


@kernel
def slide_is_free(join: Join, i: int, walls: Walls, poses: Floats) -> bool:
    """Whether the body touches nothing on the slide of row `i` of `leave`."""
    if join.leave[i, 2] == 0.0:
        return True
    table = join.slide.copy()
    table[:, CURVATURE] *= join.leave[i, 2]
    table[:, SHARPNESS] *= join.leave[i, 2]
    start = along(join.leaving, join.leaving_direction, join.leave[i, 0] - join.leave[i, 1])
    length = poses_along(start, table, len(table), poses)
    return bool(first_touch(poses[:length], walls.edges, walls.owner, True, walls.body, walls.margin_m)[0] < 0)


class Ways(NamedTuple):
    """Ways that are listed: seconds, a rough score (s), and (n, 4) row of `leave`, of `join`, backward, kind."""

    times: Floats
    rough: Floats
    which: Ints


class Room(NamedTuple):
    """Working space: the eight words of `word_table`, pieces of one, and poses along it."""

    amounts: Floats
    table: Floats
    poses: Floats


@kernel
def words_between(join: Join, i: int, j: int, direction: float, mover: Mover, amounts: Floats) -> float:
    """Write the words from row `i` of `leave` to row `j` of `join`, driven one way; the straight distance (m)."""
    start, goal = departure(join, i), along(join.joining, join.joining_direction, join.join[j, 0])
    c, s = direction * math.cos(start[2]), direction * math.sin(start[2])
    x, y = goal[0] - start[0], goal[1] - start[1]
    word_table((c * x + s * y) * mover.root, (c * y - s * x) * mover.root, goal[2] - start[2], mover.circle, amounts)
    return math.hypot(x, y)


@kernel
def over_zones_s(join: Join, i: int, j: int, direction: float, length: float, mover: Mover) -> float:
    """Seconds for both zones and a word of so many metres between row `i` of `leave` and row `j` of `join`."""
    driven, sides = np.empty(5), np.empty(5)
    driven[0], sides[0] = join.leave[i, 0], join.leaving_direction
    slid = abs(join.leave[i, 2]) * join.slide[:, LENGTH].sum()
    driven[1], sides[1] = join.leave[i, 1] + slid, -join.leaving_direction
    driven[2], sides[2] = length, direction
    driven[3], sides[3] = join.join[j, 0] - join.join[j, 1], -join.joining_direction
    driven[4], sides[4] = join.zone_m - join.join[j, 1], join.joining_direction
    return float(way_s(driven, sides, mover))


@kernel
def list_words(join: Join, at: Ints, mover: Mover, amounts: Floats, ways: Ways, found: int) -> int:
    """List the words between a row of `leave` and one of `join`, backward or not (`at`); how many ways there are."""
    i, j, direction = at[0], at[1], -1.0 if at[2] else 1.0
    longest = LONGEST_RADII * mover.circle[4] / mover.root
    direct = words_between(join, i, j, direction, mover, amounts)
    for kind in range(8):
        length = word_m(amounts[kind], kind, mover)
        if length > direct + longest:
            continue
        ways.times[found] = over_zones_s(join, i, j, direction, length, mover)
        # What of the zones is driven is rarely covered by anything else, what is passed twice in part.
        worked = join.leave[i, 0] + join.zone_m - join.join[j, 1]
        ways.rough[found] = ways.times[found] - WORKED_MORE * worked / mover.speed_mps
        ways.which[found, :3], ways.which[found, 3] = at, kind
        found += 1
    return found


@kernel
def list_ways(join: Join, walls: Walls, mover: Mover, room: Room, ways: Ways) -> int:
    """List all ways whose slide is free; how many."""
    found, at = 0, np.zeros(3, np.int64)
    for i in range(len(join.leave)):
        if not slide_is_free(join, i, walls, room.poses):
            continue
        for j in range(len(join.join)):
            if not join.cusps and (join.leave[i, 1] > 0.0 or join.join[j, 1] < join.join[j, 0]):
                continue
            for back in range(2 if join.backward else 1):
                at[0], at[1], at[2] = i, j, back
                found = list_words(join, at, mover, room.amounts, ways, found)
    return found


@kernel
def cells_gained(join: Join, way: Ints, walls: Walls, mover: Mover, grid: PassGrid, room: Room) -> int:
    """Cells that only this way (a row of `which`) and its zones pass over; −1 if the body touches something on it."""
    i, j, direction, kind = way[0], way[1], -1.0 if way[2] else 1.0, way[3]
    words_between(join, i, j, direction, mover, room.amounts)
    count = word_rows(room.amounts[kind], kind, direction, mover, room.table)
    start = departure(join, i)
    length = poses_along(start, room.table, count, room.poses)
    if first_touch(room.poses[:length], walls.edges, walls.owner, True, walls.body, walls.margin_m)[0] >= 0:
        return -1
    ask(grid)
    gained = pass_path(start, room.table, count, mover.half_width_m, grid, 0)
    line = np.zeros((1, 4))
    line[0, LENGTH], line[0, DIRECTION] = join.leave[i, 0], join.leaving_direction
    gained += pass_path(join.leaving, line, 1, mover.half_width_m, grid, 0)
    line[0, LENGTH], line[0, DIRECTION] = join.zone_m - join.join[j, 1], join.joining_direction
    begun = along(join.joining, join.joining_direction, join.join[j, 1])
    return int(gained + pass_path(begun, line, 1, mover.half_width_m, grid, 0))


@kernel
def survey(join: Join, walls: Walls, mover: Mover, grid: PassGrid, seconds_per_m2: float, patience: int) -> Floats:
    """The best way: (8,) score, seconds, m² gained, row of `leave`, row of `join`, direction, kind, first deflection.

    Ways are looked at in the order of a rough score, until so many free ones in turn were no better (`patience`). The
    score (s) is infinite if there is none.
    """
    most = len(join.leave) * len(join.join) * 16
    room = Room(np.empty((8, 3)), np.empty((WORD_PIECES, 4)), np.empty((MOST_POSES, 3)))
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
        gained = cells_gained(join, way, walls, mover, grid, room)
        if gained < 0:
            continue
        since += 1
        score = ways.times[k] - seconds_per_m2 * gained * cell
        if score < best[0]:
            since = 0
            best[0], best[1], best[2], best[3], best[4] = score, ways.times[k], gained * cell, way[0], way[1]
            best[5], best[6], best[7] = -1.0 if way[2] else 1.0, way[3], room.amounts[way[3], 0]
    return best
