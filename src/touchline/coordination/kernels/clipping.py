"""Kernels: clipping of convex polygons by half-planes (Sutherland, Hodgman, "Reentrant polygon clipping", 1974)."""

import numpy as np
from numpy.typing import NDArray

from touchline.core.half_planes import NORMAL_X, NORMAL_Y, OFFSET
from touchline.core.jit import kernel

Floats = NDArray[np.float64]


@kernel
def clip(corners: Floats, count: int, row: Floats, clipped: Floats) -> int:
    """Clip a convex polygon by a half-plane.

    Args:
        corners: (count or more, 2) counter-clockwise, m.
        count: Number of corners.
        row: (3,) NORMAL_X to OFFSET. A row without normal keeps everything or, if its offset is negative, nothing.
        clipped: (count + 1 or more, 2) filled with the clipped polygon's corners, counter-clockwise.

    Returns:
        Number of corners of the clipped polygon; 0 if it is empty.
    """
    left = 0
    for k in range(count):
        after = k + 1 if k + 1 < count else 0
        x, y = corners[k, 0], corners[k, 1]
        here = row[NORMAL_X] * x + row[NORMAL_Y] * y - row[OFFSET]
        there = row[NORMAL_X] * corners[after, 0] + row[NORMAL_Y] * corners[after, 1] - row[OFFSET]
        if here <= 0.0:
            clipped[left, 0], clipped[left, 1] = x, y
            left += 1
        if (here < 0.0 < there) or (there < 0.0 < here):
            share = here / (here - there)
            clipped[left, 0] = x + share * (corners[after, 0] - x)
            clipped[left, 1] = y + share * (corners[after, 1] - y)
            left += 1
    return left


@kernel
def clip_all(start: Floats, count: int, rows: Floats, spare: Floats, clipped: Floats) -> int:
    """Clip a convex polygon by several half-planes.

    Args:
        start: (count or more, 2) corners, counter-clockwise, m.
        count: Number of corners.
        rows: (n, 3) NORMAL_X to OFFSET; rows without normal and of an offset ≥ 0 change nothing.
        spare: (count + n or more, 2) work space.
        clipped: (count + n or more, 2) filled with the clipped polygon's corners.

    Returns:
        Number of corners of the clipped polygon; 0 if it is empty.
    """
    for k in range(count):
        clipped[k, 0], clipped[k, 1] = start[k, 0], start[k, 1]
    left = count
    for r in range(len(rows)):
        beyond = False
        for k in range(left):
            if rows[r, NORMAL_X] * clipped[k, 0] + rows[r, NORMAL_Y] * clipped[k, 1] > rows[r, OFFSET]:
                beyond = True
        if beyond:
            left = clip(clipped, left, rows[r], spare)
            for k in range(left):
                clipped[k, 0], clipped[k, 1] = spare[k, 0], spare[k, 1]
    return left
