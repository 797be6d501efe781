"""Compiled: pieces, lengths and times of turns, words and straights between strokes."""

import math
from typing import NamedTuple

import numpy as np

from touchline.core.jit import kernel
from touchline.services.planner.coverage.kernels.grid import CURVATURE, DIRECTION, LENGTH, SHARPNESS, SPIN
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.steering.circles import LIMIT, LIMIT_TURN, shortest_word, turn_length

# Pieces of a word: three turns of three.
WORD_PIECES = 9
# After the eight words of turning circles: turn on the spot, straight, turn on the spot.
SPUN, KINDS = 8, 9


class Mover(NamedTuple):
    """Motion of a machine: turning circle, speed and acceleration.

    Attributes:
        circle: Dimensions of its turning circle at unit sharpness; see `circles.circle`.
        root: √sharpness (1/m).
        speed_mps: Speed on straights.
        acceleration_mps2: Acceleration and deceleration.
        spin_lever_m: See `CoverageMachine`.
        bend_s_per_m: See `CoverageMachine`.
    """

    circle: Floats
    root: float
    speed_mps: float
    acceleration_mps2: float
    spin_lever_m: float = math.inf
    bend_s_per_m: float = 0.0


@kernel
def turn_rows(deflection: float, direction: float, mover: Mover, table: Floats, row: int) -> int:
    """Write the pieces of a turn: two clothoids and an arc, or a flatter pair of clothoids for small deflections.

    Fraichard and Scheuer, "From Reeds and Shepp's to continuous-curvature paths", IEEE T-RO 20(6), 2004.

    Args:
        deflection: Change of the direction of travel, left positive (rad).
        direction: 1 forward, −1 backward.
        mover: Motion of the machine.
        table: (n, COLUMNS) filled in: length (m), curvature (1/m), sharpness (1/m²), direction; see grid.py.
        row: First row to fill in.

    Returns:
        The next free row.
    """
    c, root, size = mover.circle, mover.root, abs(deflection)
    # Backward, a turn of the direction of travel to the left takes negative curvature.
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
    """Write the pieces of a word that is driven in one direction.

    Args:
        amounts: (3,) its row of `word_table`, straights in units of unit sharpness; for `SPUN` from `spun_between`.
        kind: Number of that row, which tells whether the middle is a straight.
        direction: 1 forward, −1 backward.
        mover: Motion of the machine.
        table: (WORD_PIECES, COLUMNS) filled in from the first row on; see `turn_rows`.

    Returns:
        Number of pieces.
    """
    if kind == SPUN:
        table[:3, :SPIN], table[:3, DIRECTION] = 0.0, direction
        table[0, SPIN], table[1, LENGTH], table[2, SPIN] = amounts[0], amounts[1], amounts[2]
        return 3
    table[:, SPIN] = 0.0
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
    """Length of a word (m); infinite if it does not exist.

    Args:
        amounts: (3,) its row of `word_table`, straights in units of unit sharpness.
        kind: Number of that row, which tells whether the middle is a straight.
        mover: Motion of the machine.
    """
    if not math.isfinite(amounts[1]):
        return math.inf
    turning = turn_length(abs(amounts[0]), mover.circle) + turn_length(abs(amounts[2]), mover.circle)
    middle = amounts[1] if kind % 4 < 2 else turn_length(abs(amounts[1]), mover.circle)
    return float((turning + middle) / mover.root)


@kernel
def spun_between(x: float, y: float, heading: float, direction: float, amounts: Floats) -> None:
    """Write the turn on the spot, straight and turn on the spot that lead to a pose.

    Args:
        x: x of the goal in the frame of the start (m).
        y: y of the goal (m).
        heading: Heading of the goal (rad).
        direction: Direction of the straight: 1 forward, −1 backward.
        amounts: (3,) filled in: turn (rad, left positive), straight (m), turn (rad).
    """
    amounts[1] = math.hypot(x, y)
    bearing = math.atan2(direction * y, direction * x) if amounts[1] > 0.0 else heading
    amounts[0] = bearing - math.tau * round(bearing / math.tau)
    amounts[2] = heading - bearing - math.tau * round((heading - bearing) / math.tau)


@kernel
def spun_s(amounts: Floats, mover: Mover) -> float:
    """Seconds for a turn on the spot, a straight and a turn on the spot, from rest to rest.

    Args:
        amounts: (3,) from `spun_between`.
        mover: Motion of the machine.
    """
    first, last = abs(amounts[0]) * mover.spin_lever_m, abs(amounts[2]) * mover.spin_lever_m
    return float(run_s(first, mover, 2) + run_s(amounts[1], mover, 2) + run_s(last, mover, 2))


@kernel
def words_s(starts: Floats, goals: Floats, mover: Mover) -> Floats:
    """Seconds for the shortest words from each start to each goal, regardless of obstacles.

    A machine that can turn on the spot does so where that is quicker, stops included.

    Args:
        starts: (n, 3) x (m), y (m), heading (rad).
        goals: (m, 3) the same.
        mover: Motion of the machine.

    Returns:
        (n, m).
    """
    seconds, amounts = np.empty((len(starts), len(goals))), np.empty(3)
    stopping_s = mover.speed_mps / mover.acceleration_mps2
    for i in range(len(starts)):
        facing = complex(math.cos(starts[i, 2]), math.sin(starts[i, 2]))
        for j in range(len(goals)):
            turn = goals[j, 2] - starts[i, 2]
            z = complex(goals[j, 0] - starts[i, 0], goals[j, 1] - starts[i, 1]) / facing
            there = complex(math.cos(turn), math.sin(turn))
            length = shortest_word(z * mover.root, there, turn, mover.circle, 1.0)
            seconds[i, j] = length / mover.root / mover.speed_mps
            # A word is longer than the straight distance by about the length of its bends.
            bent = max(length / mover.root - math.hypot(z.real, z.imag), 0.0)
            seconds[i, j] += bent * mover.bend_s_per_m
            if math.isfinite(mover.spin_lever_m):
                spun_between(z.real, z.imag, turn, 1.0, amounts)
                seconds[i, j] = min(seconds[i, j], stopping_s + spun_s(amounts, mover))
    return seconds


@kernel
def along(pose: Floats, direction: float, length: float) -> Floats:
    """Pose (3,) after a straight.

    Args:
        pose: (3,) x (m), y (m), heading (rad).
        direction: Direction of travel: 1 forward, −1 backward.
        length: Length in that direction (m); negative: back.
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
        length: Length of the stretch (m).
        mover: Motion of the machine.
        standstills: Number of its ends (0 to 2) at rest; at the others it is at full speed.
    """
    if standstills == 2 and length < mover.speed_mps**2 / mover.acceleration_mps2:
        return 2.0 * math.sqrt(length / mover.acceleration_mps2)
    return length / mover.speed_mps + 0.5 * standstills * mover.speed_mps / mover.acceleration_mps2


@kernel
def stretches_s(driven: Floats, heading_to: Floats, mover: Mover) -> float:
    """Seconds for consecutive stretches; the machine rests where the direction changes.

    The first is entered and the last left at full speed.

    Args:
        driven: (n,) their lengths (m); 0: absent.
        heading_to: (n,) their directions, 1 forward, −1 backward; the first one's counts even if its length is 0.
        mover: Motion of the machine.
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
