"""Compiled: the ways from one straight stroke to another, listed with their times and a rough score.

A stroke may be left anywhere along its end zone, and the next one joined anywhere along its begin zone; or the zone is
driven to its end and the machine goes back, which takes a cusp. In between lies one of the eight words of turning
circles (circles.py), forward or backward.
"""

import math
from typing import NamedTuple

import numpy as np

from touchline.services.core.jit import kernel
from touchline.services.planner.coverage.kernels.body_room import Walls, keeps_off, poses_along, stands_free
from touchline.services.planner.coverage.kernels.grid import CURVATURE, LENGTH, SHARPNESS
from touchline.services.planner.coverage.kernels.turn_words import Mover, along, way_s, word_m, word_rows
from touchline.services.planner.geometry.clothoid import Floats, Ints
from touchline.services.planner.steering.circles import word_table

# Longer words wind round themselves to no purpose: so many turning radii, beside the straight distance.
LONGEST_RADII = 12.0
# Roughly, driving a zone further is worth so many times the seconds that it takes.
WORKED_MORE = 2.5


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
