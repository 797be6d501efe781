"""Compiled: candidate transitions from one straight stroke to another, with their times and a rough score.

A stroke may be left anywhere along its end zone, and the next one joined anywhere along its begin zone; or the zone is
driven to its end and the machine goes back, which takes a cusp. In between lies one of the eight words of turning
circles (circles.py), forward or backward; or, for a machine that can, a turn on the spot, a straight and another turn.
"""

import math
from typing import NamedTuple

import numpy as np

from touchline.core.jit import kernel
from touchline.services.planner.coverage.kernels.grid import CURVATURE, LENGTH, SHARPNESS
from touchline.services.planner.coverage.kernels.turn_pieces import (
    SPUN,
    Mover,
    along,
    run_s,
    spun_between,
    spun_s,
    stretches_s,
    word_m,
    word_rows,
)
from touchline.services.planner.coverage.kernels.wall_clearance import Walls, keeps_off, poses_along, stands_free
from touchline.services.planner.geometry.clothoid import Floats, Ints
from touchline.services.planner.steering.circles import word_table

# Longer words only wind round themselves: limit in turning radii beyond the straight distance.
LONGEST_RADII = 12.0
# Slides are numbered by where they lead and by direction: backward off the first stroke and onto the second, forward
# off the first and onto the second.
OFF, ONTO, SLIDES = 0, 1, 4
# In the rough score, driving a zone further is worth this multiple of its seconds.
WORKED_MORE = 2.5


class Join(NamedTuple):
    """Zones of two strokes, and the positions at which they may be left and joined (m along the direction of travel).

    Attributes:
        leaving: (3,) pose at the beginning of the first stroke's end zone.
        leaving_direction: ±1.
        leave: (n, 4) length driven of the zone, length driven straight back from there, side of the slide that
            follows (±1, 0: none), and its direction (1: of travel, 0: back).
        slides: (SLIDES, 4, COLUMNS) pieces of the slides to the left.
        slid: (SLIDES, 2) end of each slide relative to its beginning.
        joining: (3,) pose at the beginning of the second stroke's begin zone.
        joining_direction: ±1.
        zone_m: Length of the begin zone.
        join: (m, 4) end of the word, or of the slide after it; beginning of the driven part of the zone, there or
            before it; side of the slide (±1, 0: none), and its direction (1: of travel, 0: back).
        cusps: Whether the machine may drive back on a zone.
        backward: Whether words may be driven backward.
    """

    leaving: Floats
    leaving_direction: float
    leave: Floats
    slides: Floats
    slid: Floats
    joining: Floats
    joining_direction: float
    zone_m: float
    join: Floats
    cusps: bool
    backward: bool


@kernel
def departure(join: Join, i: int) -> Floats:
    """Pose (3,) at which the word begins: x (m), y (m), heading (rad).

    Args:
        join: Zones of the two strokes.
        i: Row of `leave`.
    """
    pose: Floats = along(join.leaving, join.leaving_direction, join.leave[i, 0] - join.leave[i, 1])
    if join.leave[i, 2] != 0.0:
        slid, side = join.slid[slide_of(join.leave[i], OFF)], join.leave[i, 2]
        c, s = math.cos(pose[2]), math.sin(pose[2])
        pose[0] += c * slid[0] - s * side * slid[1]
        pose[1] += s * slid[0] + c * side * slid[1]
    return pose


@kernel
def arrival(join: Join, j: int) -> Floats:
    """Pose (3,) at which the word ends: x (m), y (m), heading (rad).

    Args:
        join: Zones of the two strokes.
        j: Row of `join`.
    """
    pose: Floats = along(join.joining, join.joining_direction, join.join[j, 0])
    if join.join[j, 2] != 0.0:
        slid, side = join.slid[slide_of(join.join[j], ONTO)], join.join[j, 2]
        c, s = math.cos(pose[2]), math.sin(pose[2])
        pose[0] -= c * slid[0] - s * side * slid[1]
        pose[1] -= s * slid[0] + c * side * slid[1]
    return pose


@kernel
def slide_of(row: Floats, which: int) -> int:
    """Number of the slide of a row of `leave` or `join`.

    Args:
        row: (4,) of `Join.leave` or `Join.join`.
        which: `OFF` or `ONTO`.
    """
    return which + 2 * int(row[3])


@kernel
def slide_table(join: Join, row: Floats, which: int) -> Floats:
    """Pieces (4, COLUMNS) of the slide of a row that has one.

    Args:
        join: Zones of the two strokes.
        row: (4,) of `Join.leave` or `Join.join`.
        which: `OFF` or `ONTO`.
    """
    table: Floats = join.slides[slide_of(row, which)].copy()
    table[:, CURVATURE] *= row[2]
    table[:, SHARPNESS] *= row[2]
    return table


@kernel
def slid_m(join: Join, row: Floats, which: int, onward: float) -> float:
    """Length of a row's slide if it has the given direction, else 0 (m).

    Args:
        join: Zones of the two strokes.
        row: (4,) of `Join.leave` or `Join.join`.
        which: `OFF` or `ONTO`.
        onward: 1 in the direction of travel, 0 back.
    """
    if row[3] != onward:
        return 0.0
    return float(abs(row[2]) * join.slides[slide_of(row, which), :, LENGTH].sum())


@kernel
def slide_is_free(join: Join, i: int, walls: Walls, poses: Floats) -> bool:
    """True if the body touches nothing on the slide after a zone, or there is none.

    Args:
        join: Zones of the two strokes.
        i: Row of `leave`.
        walls: Outlines that the body keeps off.
        poses: (n, 3) working space.
    """
    if join.leave[i, 2] == 0.0:
        return True
    start = along(join.leaving, join.leaving_direction, join.leave[i, 0] - join.leave[i, 1])
    table = slide_table(join, join.leave[i], OFF)
    length = poses_along(start, table, len(table), poses)
    return bool(stands_free(start, walls) and keeps_off(poses[:length], walls))


@kernel
def slide_on_is_free(join: Join, j: int, walls: Walls, poses: Floats) -> bool:
    """True if the body touches nothing on the slide before a zone, or there is none.

    Args:
        join: Zones of the two strokes.
        j: Row of `join`.
        walls: Outlines that the body keeps off.
        poses: (n, 3) working space.
    """
    if join.join[j, 2] == 0.0:
        return True
    start, table = arrival(join, j), slide_table(join, join.join[j], ONTO)
    length = poses_along(start, table, len(table), poses)
    return bool(stands_free(start, walls) and keeps_off(poses[:length], walls))


class Candidates(NamedTuple):
    """List of candidates: seconds, a rough score (s), and (n, 4) row of `leave`, of `join`, backward, kind."""

    times: Floats
    rough: Floats
    which: Ints


class Room(NamedTuple):
    """Working space, and results that are cached by position on the zones.

    Attributes:
        amounts: (KINDS, 3) words of `word_table`, and turns on the spot of `spun_between`.
        table: (WORD_PIECES, COLUMNS) pieces of one.
        poses: (MOST_POSES, 3) along it.
        driven: (5,) lengths of the stretches of a transition.
        heading_to: (5,) their directions.
        stands: (n,) for each row of `leave`: 1 if the body is free where the word begins, 0 if not, −1: unknown.
        leave_cells: (n,) for each row of `leave`: cells that only its zone passes over; −1: unknown.
        join_cells: (m,) the same for each row of `join`.
    """

    amounts: Floats
    table: Floats
    poses: Floats
    driven: Floats
    heading_to: Floats
    stands: Ints
    leave_cells: Ints
    join_cells: Ints


@kernel
def words_between(join: Join, i: int, j: int, direction: float, mover: Mover, amounts: Floats) -> float:
    """Write the words between the places where one zone is left and the other joined.

    Args:
        join: Zones of the two strokes.
        i: Row of `leave`.
        j: Row of `join`.
        direction: Direction of the word: 1 forward, −1 backward.
        mover: Motion of the machine.
        amounts: (KINDS, 3) filled in as by `word_table`, straights in units of unit sharpness, and by `spun_between`.

    Returns:
        The straight distance (m).
    """
    start, goal = departure(join, i), arrival(join, j)
    c, s = direction * math.cos(start[2]), direction * math.sin(start[2])
    x, y = goal[0] - start[0], goal[1] - start[1]
    ahead, left, turn = c * x + s * y, c * y - s * x, goal[2] - start[2]
    word_table(ahead * mover.root, left * mover.root, turn, mover.circle, amounts[:SPUN])
    spun_between(direction * ahead, direction * left, turn, direction, amounts[SPUN])
    return math.hypot(x, y)


@kernel
def over_zones_s(join: Join, i: int, j: int, direction: float, length: float, mover: Mover, room: Room) -> float:
    """Seconds for both zones and the word between them.

    Args:
        join: Zones of the two strokes.
        i: Row of `leave`.
        j: Row of `join`.
        direction: Direction of the word: 1 forward, −1 backward.
        length: Length of the word (m).
        mover: Motion of the machine.
        room: Working space.
    """
    driven, sides = room.driven, room.heading_to
    driven[0], sides[0] = join.leave[i, 0] + slid_m(join, join.leave[i], OFF, 1.0), join.leaving_direction
    driven[1], sides[1] = join.leave[i, 1] + slid_m(join, join.leave[i], OFF, 0.0), -join.leaving_direction
    driven[2], sides[2] = length, direction
    again = join.join[j, 0] - join.join[j, 1] + slid_m(join, join.join[j], ONTO, 0.0)
    driven[3], sides[3] = again, -join.joining_direction
    onto = join.zone_m - join.join[j, 1] + slid_m(join, join.join[j], ONTO, 1.0)
    driven[4], sides[4] = onto, join.joining_direction
    return float(stretches_s(driven, sides, mover))


@kernel
def resting_s(join: Join, i: int, j: int, mover: Mover) -> float:
    """Seconds for both zones, with a rest at the ends of the transition.

    Args:
        join: Zones of the two strokes.
        i: Row of `leave`.
        j: Row of `join`.
        mover: Motion of the machine.
    """
    back = join.leave[i, 1] + slid_m(join, join.leave[i], OFF, 0.0)
    again = join.join[j, 0] - join.join[j, 1] + slid_m(join, join.join[j], ONTO, 0.0)
    leaving = join.leave[i, 0] + slid_m(join, join.leave[i], OFF, 1.0)
    joining = join.zone_m - join.join[j, 1] + slid_m(join, join.join[j], ONTO, 1.0)
    return float(run_s(leaving, mover, 1) + run_s(joining, mover, 1) + run_s(back, mover, 2) + run_s(again, mover, 2))


@kernel
def list_words(join: Join, at: Ints, mover: Mover, room: Room, candidates: Candidates, found: int) -> int:
    """List the words between two positions that are not too long; see `LONGEST_RADII`.

    Args:
        join: Zones of the two strokes.
        at: (3,) row of `leave`, row of `join`, and whether the word is driven backward (0, 1).
        mover: Motion of the machine.
        room: Working space.
        candidates: Filled in from row `found` on.
        found: Number of candidates so far.

    Returns:
        Number of candidates now.
    """
    i, j, direction = at[0], at[1], -1.0 if at[2] else 1.0
    longest = LONGEST_RADII * mover.circle[4] / mover.root
    direct = words_between(join, i, j, direction, mover, room.amounts)
    for kind in range(8):
        length = word_m(room.amounts[kind], kind, mover)
        if length > direct + longest:
            continue
        middle = room.amounts[kind, 1] / mover.root if kind % 4 < 2 else 0.0
        candidates.times[found] = over_zones_s(join, i, j, direction, length, mover, room)
        candidates.times[found] += (length - middle) * mover.bend_s_per_m
        # The driven part of a zone is rarely covered by anything else.
        worked = join.leave[i, 0] + join.zone_m - join.join[j, 1]
        candidates.rough[found] = candidates.times[found] - WORKED_MORE * worked / mover.speed_mps
        candidates.which[found, :3], candidates.which[found, 3] = at, kind
        found += 1
    if math.isfinite(mover.spin_lever_m):
        candidates.times[found] = resting_s(join, i, j, mover) + spun_s(room.amounts[SPUN], mover)
        worked = join.leave[i, 0] + join.zone_m - join.join[j, 1]
        candidates.rough[found] = candidates.times[found] - WORKED_MORE * worked / mover.speed_mps
        candidates.which[found, :3], candidates.which[found, 3] = at, SPUN
        found += 1
    return found


@kernel
def list_candidates(join: Join, walls: Walls, mover: Mover, room: Room, candidates: Candidates) -> int:
    """List all candidates whose slide is free, from the first row on.

    Args:
        join: Zones of the two strokes.
        walls: Outlines that the body keeps off.
        mover: Motion of the machine.
        room: Working space.
        candidates: Filled in; room for 2·KINDS for each row of `leave` with each of `join`.

    Returns:
        Number of candidates.
    """
    found, at = 0, np.zeros(3, np.int64)
    arrives = np.zeros(len(join.join), np.bool_)
    for j in range(len(join.join)):
        arrives[j] = slide_on_is_free(join, j, walls, room.poses)
    for i in range(len(join.leave)):
        if not slide_is_free(join, i, walls, room.poses):
            continue
        for j in range(len(join.join)):
            if not arrives[j]:
                continue
            if not join.cusps and (join.leave[i, 1] > 0.0 or join.join[j, 1] < join.join[j, 0]):
                continue
            for back in range(2 if join.backward else 1):
                at[0], at[1], at[2] = i, j, back
                found = list_words(join, at, mover, room, candidates, found)
    return found


@kernel
def lay_word(join: Join, candidate: Ints, mover: Mover, room: Room) -> int:
    """Write the word of a candidate.

    Args:
        join: Zones of the two strokes.
        candidate: (4,) a row of `Candidates.which`.
        mover: Motion of the machine.
        room: Filled in: `amounts` with all words between its positions, `table` with the pieces of its own.

    Returns:
        Number of pieces.
    """
    direction, kind = -1.0 if candidate[2] else 1.0, candidate[3]
    words_between(join, candidate[0], candidate[1], direction, mover, room.amounts)
    return int(word_rows(room.amounts[kind], kind, direction, mover, room.table))
