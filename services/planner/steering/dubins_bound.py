"""Compiled: a lower bound on the length of any path of bounded curvature, the plain Dubins path (Dubins 1957)."""

import math

import numpy as np

from touchline.core.angles import TAU
from touchline.core.jit import kernel
from touchline.services.planner.steering.circles import left_centres, other_side, same_side, three_turns, wrapped

# Dimensions (see circles.py) of a turn that is just an arc of radius 1.
PLAIN = np.array((1.0, 0.0, 0.0, 1.0, 1.0, 0.0))
# A deflection (rad) this close below a full turn, and circles this close to one another, may be due to rounding.
BLURRED = 1e-6


@kernel
def least_plain(x: float, y: float, heading: float) -> float:
    """Length of the plain Dubins path of radius 1 (Dubins 1957) from the origin, heading along +x, to a goal.

    Rounding makes it a little less, never more: a lower bound for curvature of at most 1.

    Args:
        x: x of the goal, in radii.
        y: y of the goal, in radii.
        heading: Heading of the goal (rad).
    """
    cos, sin = math.cos(heading), math.sin(heading)
    best = math.inf
    for side in (1.0, -1.0):
        left_x, left_y, right_x, right_y = left_centres(x, side * y, cos, side * sin, PLAIN)
        turn = side * heading
        if math.hypot(left_x, left_y) < BLURRED:
            best = min(best, _sharp(wrapped(turn)))
        first, middle, last = same_side(left_x, left_y, turn, PLAIN)
        best = min(best, _sharp(first) + middle + _sharp(last))
        first, middle, last = other_side(right_x, right_y, turn, PLAIN)
        if middle >= 0.0:
            best = min(best, _sharp(first) + middle + _sharp(last))
        for bulge in (1.0, -1.0):
            first, middle, last = three_turns(left_x, left_y, turn, bulge, PLAIN)
            if middle >= 0.0:
                best = min(best, _sharp(first) + _sharp(middle) + _sharp(last))
    return best


@kernel
def _sharp(turn: float) -> float:
    return turn if turn < TAU - BLURRED else 0.0
