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
from touchline.services.planner.coverage.kernels.body_room import (
    Walls,
    keeps_off,
    poses_along,
    stands_free,
)
from touchline.services.planner.coverage.kernels.grid import (
    CURVATURE,
    DIRECTION,
    LENGTH,
    SHARPNESS,
    PassGrid,
    ask,
    pass_path,
)
from touchline.services.planner.geometry.clothoid import Floats, Ints
from touchline.services.planner.steering.circles import LIMIT, LIMIT_TURN, turn_length, word_table

# So many pieces make a word: three turns of three.
WORD_PIECES = 9
# Longer words wind round themselves to no purpose: so many turning radii, beside the straight distance.
LONGEST_RADII = 12.0
# Roughly, driving a zone further is worth so many times the seconds that it takes.
WORKED_MORE = 2.5
# Where so many ways touch something there is none.
HOPELESS = 2500
MOST_POSES = 4000


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
    """Write the pieces of a turn: two clothoids and an arc, or the flatter pair of clothoids where it turns little.

    Fraichard and Scheuer, "From Reeds and Shepp's to continuous-curvature paths", IEEE T-RO 20(6), 2004.

    Args:
        deflection: Of the direction of travel, to the left (rad).
        direction: 1 forward, −1 backward.
        mover: How the machine moves.
        table: (n, 4) filled in: length (m), curvature (1/m), sharpness (1/m²), direction; see grid.py.
        row: The first one to fill in.

    Returns:
        The next free row.
    """
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
    """Write the pieces of a word that is driven one way.

    Args:
        amounts: (3,) its row of `word_table`, straights in units of unit sharpness.
        kind: The number of that row, which says whether the middle is a straight.
        direction: 1 forward, −1 backward.
        mover: How the machine moves.
        table: (WORD_PIECES, 4) filled in from the first row on; see `turn_rows`.

    Returns:
        How many pieces there are.
    """
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
    """Length of a word (m); infinite if there is none.

    Args:
        amounts: (3,) its row of `word_table`, straights in units of unit sharpness.
        kind: The number of that row, which says whether the middle is a straight.
        mover: How the machine moves.
    """
    if not math.isfinite(amounts[1]):
        return math.inf
    turning = turn_length(abs(amounts[0]), mover.circle) + turn_length(abs(amounts[2]), mover.circle)
    middle = amounts[1] if kind % 4 < 2 else turn_length(abs(amounts[1]), mover.circle)
    return float((turning + middle) / mover.root)


@kernel
def along(pose: Floats, direction: float, length: float) -> Floats:
    """The pose (3,) after a straight.

    Args:
        pose: (3,) x (m), y (m), heading (rad).
        direction: Of travel: 1 forward, −1 backward.
        length: In that direction (m); negative: back.
    """
    moved = np.empty(3)
    moved[0] = pose[0] + direction * length * math.cos(pose[2])
    moved[1] = pose[1] + direction * length * math.sin(pose[2])
    moved[2] = pose[2]
    return moved


@kernel
def run_s(length: float, mover: Mover, standstills: int) -> float:
    """Seconds for a stretch in one direction; as `CoverageMachine.run_s`.

    Speed is a trapezoid over time, or a triangle where a stretch from standstill to standstill is too short for it.

    Args:
        length: m.
        mover: How the machine moves.
        standstills: How many of its ends (0 to 2) are at rest; at the others it is at full speed.
    """
    if standstills == 2 and length < mover.speed_mps**2 / mover.acceleration_mps2:
        return 2.0 * math.sqrt(length / mover.acceleration_mps2)
    return length / mover.speed_mps + 0.5 * standstills * mover.speed_mps / mover.acceleration_mps2


@kernel
def way_s(driven: Floats, heading_to: Floats, mover: Mover) -> float:
    """Seconds for stretches one after the other; the machine rests where the direction changes.

    The first is entered and the last left at full speed.

    Args:
        driven: (n,) their lengths (m); 0: there is none.
        heading_to: (n,) their directions, 1 forward, −1 backward; the first one's counts even if its length is 0.
        mover: How the machine moves.
    """
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
    """The pose (3,) at which the word begins: x (m), y (m), heading (rad).

    Args:
        join: Zones of the two strokes.
        i: Row of `leave`.
    """
    pose: Floats = along(join.leaving, join.leaving_direction, join.leave[i, 0] - join.leave[i, 1])
    if join.leave[i, 2] != 0.0:
        x, y, c, s = join.slid[0], join.leave[i, 2] * join.slid[1], math.cos(pose[2]), math.sin(pose[2])
        pose[0] += c * x - s * y
        pose[1] += s * x + c * y
    return pose


@kernel
def slide_is_free(join: Join, i: int, walls: Walls, poses: Floats) -> bool:
    """Whether the body touches nothing on the slide that follows a zone; true if there is no slide.

    Args:
        join: Zones of the two strokes.
        i: Row of `leave`.
        walls: What the body keeps off.
        poses: (n, 3) working space.
    """
    if join.leave[i, 2] == 0.0:
        return True
    table = join.slide.copy()
    table[:, CURVATURE] *= join.leave[i, 2]
    table[:, SHARPNESS] *= join.leave[i, 2]
    start = along(join.leaving, join.leaving_direction, join.leave[i, 0] - join.leave[i, 1])
    length = poses_along(start, table, len(table), poses)
    return bool(stands_free(start, walls) and keeps_off(poses[:length], walls))


class Ways(NamedTuple):
    """Ways that are listed: seconds, a rough score (s), and (n, 4) row of `leave`, of `join`, backward, kind."""

    times: Floats
    rough: Floats
    which: Ints


class Room(NamedTuple):
    """Working space, and what is known of places on zones so far.

    Attributes:
        amounts: (8, 3) words of `word_table`.
        table: (WORD_PIECES, 4) pieces of one.
        poses: (MOST_POSES, 3) along it.
        driven: (5,) lengths of the stretches of a way.
        heading_to: (5,) their directions.
        stands: (n,) for each row of `leave`: whether the body stands free where the word begins (1, 0; −1: not known).
        left: (n,) for each row of `leave`: cells that only its zone passes over; −1: not known.
        joined: (m,) the same for each row of `join`.
    """

    amounts: Floats
    table: Floats
    poses: Floats
    driven: Floats
    heading_to: Floats
    stands: Ints
    left: Ints
    joined: Ints


@kernel
def words_between(join: Join, i: int, j: int, direction: float, mover: Mover, amounts: Floats) -> float:
    """Write the words between the places where one zone is left and the other joined.

    Args:
        join: Zones of the two strokes.
        i: Row of `leave`.
        j: Row of `join`.
        direction: Of the word: 1 forward, −1 backward.
        mover: How the machine moves.
        amounts: (8, 3) filled in as by `word_table`, straights in units of unit sharpness.

    Returns:
        The straight distance (m).
    """
    start, goal = departure(join, i), along(join.joining, join.joining_direction, join.join[j, 0])
    c, s = direction * math.cos(start[2]), direction * math.sin(start[2])
    x, y = goal[0] - start[0], goal[1] - start[1]
    word_table((c * x + s * y) * mover.root, (c * y - s * x) * mover.root, goal[2] - start[2], mover.circle, amounts)
    return math.hypot(x, y)


@kernel
def over_zones_s(join: Join, i: int, j: int, direction: float, length: float, mover: Mover, room: Room) -> float:
    """Seconds for both zones and the word between them.

    Args:
        join: Zones of the two strokes.
        i: Row of `leave`.
        j: Row of `join`.
        direction: Of the word: 1 forward, −1 backward.
        length: Of the word (m).
        mover: How the machine moves.
        room: Working space.
    """
    driven, sides = room.driven, room.heading_to
    driven[0], sides[0] = join.leave[i, 0], join.leaving_direction
    slid = abs(join.leave[i, 2]) * join.slide[:, LENGTH].sum()
    driven[1], sides[1] = join.leave[i, 1] + slid, -join.leaving_direction
    driven[2], sides[2] = length, direction
    driven[3], sides[3] = join.join[j, 0] - join.join[j, 1], -join.joining_direction
    driven[4], sides[4] = join.zone_m - join.join[j, 1], join.joining_direction
    return float(way_s(driven, sides, mover))


@kernel
def list_words(join: Join, at: Ints, mover: Mover, room: Room, ways: Ways, found: int) -> int:
    """List the words between two places that are not too long; see `LONGEST_RADII`.

    Args:
        join: Zones of the two strokes.
        at: (3,) row of `leave`, row of `join`, and whether the word is driven backward (0, 1).
        mover: How the machine moves.
        room: Working space.
        ways: Filled in from row `found` on.
        found: How many ways it has.

    Returns:
        How many it has now.
    """
    i, j, direction = at[0], at[1], -1.0 if at[2] else 1.0
    longest = LONGEST_RADII * mover.circle[4] / mover.root
    direct = words_between(join, i, j, direction, mover, room.amounts)
    for kind in range(8):
        length = word_m(room.amounts[kind], kind, mover)
        if length > direct + longest:
            continue
        ways.times[found] = over_zones_s(join, i, j, direction, length, mover, room)
        # What of the zones is driven is rarely covered by anything else, what is passed twice in part.
        worked = join.leave[i, 0] + join.zone_m - join.join[j, 1]
        ways.rough[found] = ways.times[found] - WORKED_MORE * worked / mover.speed_mps
        ways.which[found, :3], ways.which[found, 3] = at, kind
        found += 1
    return found


@kernel
def list_ways(join: Join, walls: Walls, mover: Mover, room: Room, ways: Ways) -> int:
    """List all ways whose slide is free, from the first row on.

    Args:
        join: Zones of the two strokes.
        walls: What the body keeps off.
        mover: How the machine moves.
        room: Working space.
        ways: Filled in; room for 16 for each row of `leave` with each of `join`.

    Returns:
        How many there are.
    """
    found, at = 0, np.zeros(3, np.int64)
    for i in range(len(join.leave)):
        if not slide_is_free(join, i, walls, room.poses):
            continue
        for j in range(len(join.join)):
            if not join.cusps and (join.leave[i, 1] > 0.0 or join.join[j, 1] < join.join[j, 0]):
                continue
            for back in range(2 if join.backward else 1):
                at[0], at[1], at[2] = i, j, back
                found = list_words(join, at, mover, room, ways, found)
    return found


@kernel
def lay_word(join: Join, way: Ints, mover: Mover, room: Room) -> int:
    """Write the word of a way.

    Args:
        join: Zones of the two strokes.
        way: (4,) a row of `Ways.which`.
        mover: How the machine moves.
        room: Filled in: `amounts` are the words of this way's places, `table` the pieces of its own.

    Returns:
        How many pieces there are.
    """
    direction, kind = -1.0 if way[2] else 1.0, way[3]
    words_between(join, way[0], way[1], direction, mover, room.amounts)
    return int(word_rows(room.amounts[kind], kind, direction, mover, room.table))


@kernel
def left_cells(join: Join, i: int, mover: Mover, grid: PassGrid) -> int:
    """Cells of the first stroke's end zone, as far as it is driven, that nothing passed over in this question.

    Args:
        join: Zones of the two strokes.
        i: Row of `leave`.
        mover: How the machine moves.
        grid: What is covered so far.
    """
    line = np.zeros((1, 4))
    line[0, LENGTH], line[0, DIRECTION] = join.leave[i, 0], join.leaving_direction
    return int(pass_path(join.leaving, line, 1, mover.half_width_m, grid, 0))


@kernel
def joined_cells(join: Join, j: int, mover: Mover, grid: PassGrid) -> int:
    """Cells of the second stroke's begin zone, as far as it is driven, that nothing passed over in this question.

    Args:
        join: Zones of the two strokes.
        j: Row of `join`.
        mover: How the machine moves.
        grid: What is covered so far.
    """
    line = np.zeros((1, 4))
    line[0, LENGTH], line[0, DIRECTION] = join.zone_m - join.join[j, 1], join.joining_direction
    begun = along(join.joining, join.joining_direction, join.join[j, 1])
    return int(pass_path(begun, line, 1, mover.half_width_m, grid, 0))


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
def zone_cells(join: Join, way: Ints, mover: Mover, grid: PassGrid, room: Room) -> int:
    """Cells that only the zones of a way pass over, those twice that both do.

    Args:
        join: Zones of the two strokes.
        way: (4,) a row of `Ways.which`.
        mover: How the machine moves.
        grid: Asked new questions; its `passes` stay.
        room: Its `left` and `joined` are filled in.
    """
    i, j = way[0], way[1]
    if room.left[i] < 0:
        ask(grid)
        room.left[i] = left_cells(join, i, mover, grid)
    if room.joined[j] < 0:
        ask(grid)
        room.joined[j] = joined_cells(join, j, mover, grid)
    return int(room.left[i] + room.joined[j])


@kernel
def cells_gained(join: Join, way: Ints, count: int, enough: float, mover: Mover, grid: PassGrid, room: Room) -> int:
    """Cells that only a way and its zones pass over.

    Args:
        join: Zones of the two strokes.
        way: (4,) a row of `Ways.which`.
        count: So many pieces in `room.table` are its word.
        enough: Fewer cells need not be counted.
        mover: How the machine moves.
        grid: Asked new questions; its `passes` stay.
        room: Holds the word.

    Returns:
        Their number; −1 if it is less than `enough`.
    """
    alone = zone_cells(join, way, mover, grid, room)
    ask(grid)
    gained = pass_path(departure(join, way[0]), room.table, count, mover.half_width_m, grid, 0)
    if gained + alone < enough:
        return -1
    gained += left_cells(join, way[0], mover, grid)
    return int(gained + joined_cells(join, way[1], mover, grid))


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
        (8,) score (s), seconds, m² gained, row of `leave`, row of `join`, direction (±1), kind (row of `word_table`),
        and first deflection (rad). The score is infinite if there is none.
    """
    leaves, joins = len(join.leave), len(join.join)
    most = leaves * joins * 16
    room = Room(
        np.empty((8, 3)),
        np.empty((WORD_PIECES, 4)),
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
        gained = cells_gained(join, way, count, enough, mover, grid, room)
        score = ways.times[k] - seconds_per_m2 * gained * cell
        if gained >= 0 and score < best[0]:
            since = 0
            best[0], best[1], best[2], best[3], best[4] = score, ways.times[k], gained * cell, way[0], way[1]
            best[5], best[6], best[7] = -1.0 if way[2] else 1.0, way[3], room.amounts[way[3], 0]
    return best
