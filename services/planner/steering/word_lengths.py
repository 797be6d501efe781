"""Lengths of the words between many poses at once: less than a microsecond each.

Poses are rows of x (m), y (m), heading (rad) and curvature (1/m). The words are the six of `circles.py`, with ramps
between straight and the curvatures at both ends. The shortest forward path (`Steering.between`) has the same length or
is a few per cent shorter, except for goals within five turning radii, whose transitions are timed again.
"""

import math

import numpy as np

from touchline.core.arcs import unit
from touchline.core.jit import kernel
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.steering.circles import circle, shortest_word
from touchline.services.planner.steering.unit_clothoid import steep_ramp

# Columns of a straight pose: position, direction, heading, and length of the ramp between it and the original pose.
_X, _Y, _COS, _SIN, _HEADING, _RAMP = range(6)


def word_lengths(
    starts: Floats, goals: Floats, curvature_max_1pm: float, sharpness_max_1pm2: float, *, turn_weight: float = 1.0
) -> Floats:
    """Lengths (m) (n, m) of the shortest words from every start to every goal.

    Args:
        starts: (n, 4) x (m), y (m), heading (rad), curvature (1/m).
        goals: (m, 4) the same.
        curvature_max_1pm: Maximum curvature of turns.
        sharpness_max_1pm2: Maximum sharpness.
        turn_weight: Factor on the length of turns. With the ratio of the speeds on straights and in turns, words are
            chosen and measured by time: the result divided by the speed on straights is seconds.
    """
    root = math.sqrt(sharpness_max_1pm2)
    leaving, reaching = _straight_poses(starts, root, leaving=True), _straight_poses(goals, root, leaving=False)
    out = np.empty((len(starts), len(goals)))
    _fill_lengths(leaving, reaching, circle(curvature_max_1pm / root), turn_weight, out)
    return out / root


def _straight_poses(poses: Floats, root: float, *, leaving: bool) -> Floats:
    """Poses (n, 6) after the ramps to straight (before those from straight, if not `leaving`)."""
    table = np.empty((len(poses), 6))
    _fill_straight_poses(np.asarray(poses, dtype=np.float64), root, leaving, table)
    return table


@kernel
def _fill_straight_poses(poses: Floats, root: float, leaving: bool, table: Floats) -> None:
    """Fill in the straight poses of poses (n, 4) in metres, in units of unit sharpness."""
    for i in range(len(poses)):
        k, heading = poses[i, 3] / root, poses[i, 2]
        move, turn = steep_ramp(k, 0.0)
        if not leaving:
            # A ramp into a goal is, seen from the goal, the mirror image of the ramp out of a start of its curvature.
            move, turn = -move.conjugate(), -turn
        point = complex(poses[i, 0], poses[i, 1]) * root + unit(heading) * move
        heading += turn
        table[i, _X], table[i, _Y] = point.real, point.imag
        table[i, _COS], table[i, _SIN] = math.cos(heading), math.sin(heading)
        table[i, _HEADING], table[i, _RAMP] = heading, abs(k)


@kernel
def _fill_lengths(starts: Floats, goals: Floats, c: Floats, weight: float, out: Floats) -> None:
    for i in range(len(starts)):
        for j in range(len(goals)):
            out[i, j] = _length(starts[i], goals[j], c, weight)


@kernel
def _length(s: Floats, g: Floats, c: Floats, weight: float) -> float:
    """Length of the shortest word and its ramps, in units of unit sharpness."""
    dx, dy = g[_X] - s[_X], g[_Y] - s[_Y]
    x, y = dx * s[_COS] + dy * s[_SIN], dy * s[_COS] - dx * s[_SIN]
    cos, sin = g[_COS] * s[_COS] + g[_SIN] * s[_SIN], g[_SIN] * s[_COS] - g[_COS] * s[_SIN]
    ramps = s[_RAMP] + g[_RAMP]
    word = shortest_word(complex(x, y), complex(cos, sin), g[_HEADING] - s[_HEADING], c, weight)
    return float(weight * ramps + word)
