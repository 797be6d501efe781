"""Where a path that is given by points is driven the other way: the edges between the lanes of an area."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def lane_edges(points_m: NDArray[np.float64]) -> list[int]:
    """Indices of the points (n, 2) at which the direction of travel turns by a right angle or more.

    That is where Δp_k·Δp_{k+1} ≤ 0. The direction of travel is what reverses at a cusp: the heading does not jump
    there, nor does the slope Δy/Δx, which is the same both ways and has a pole besides. Points have to be further apart
    than they are wrong; of those that coincide the first counts.
    """
    moved = np.flatnonzero(np.any(np.diff(points_m, axis=0) != 0.0, axis=1)) + 1
    kept = np.concatenate(([0], moved))
    steps = np.diff(points_m[kept], axis=0)
    turned = np.sum(steps[:-1] * steps[1:], axis=1) <= 0.0
    return [int(index) for index in kept[1:-1][turned]]
