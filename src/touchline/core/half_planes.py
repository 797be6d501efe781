"""Convex sets in kernels: rows of half-planes {q: n·q ≤ offset}, NORMAL_X to OFFSET; points are complex, x + iy (m)."""

import math

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel

Floats = NDArray[np.float64]
# Columns of a half-plane: its outward unit normal n, and the offset (m). A row of zeros has no effect.
NORMAL_X, NORMAL_Y, OFFSET = range(3)


@kernel
def excess_m(rows: Floats, point: complex) -> float:
    """Signed distance (m) of a point from the set: positive outside, negative inside; −inf without half-planes.

    Args:
        rows: (k, 3) half-planes.
        point: Point, m.
    """
    most = -math.inf
    for k in range(len(rows)):
        x, y = rows[k, NORMAL_X], rows[k, NORMAL_Y]
        if x != 0.0 or y != 0.0:
            most = max(most, x * point.real + y * point.imag - rows[k, OFFSET])
    return most


@kernel
def permits(rows: Floats, here: complex, after: complex, stop: complex) -> bool:
    """Rule of motion: true if after a step the position and the stopping point are inside.

    A robot outside a half-plane may stay at its distance from it, but go no farther out.

    Args:
        rows: (k, 3) half-planes.
        here: Position of the robot (m).
        after: Position after the step (m).
        stop: Position of rest after braking from there (m).
    """
    for k in range(len(rows)):
        x, y = rows[k, NORMAL_X], rows[k, NORMAL_Y]
        limit = max(rows[k, OFFSET], x * here.real + y * here.imag)
        if x * after.real + y * after.imag > limit or x * stop.real + y * stop.imag > limit:
            return False
    return True
