"""Edges of the ground that a scan has not seen: behind things, and beside the lidar's field."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import borrowing, kernel
from touchline.onboard.perception.scan import NOTHING, UNCONFIRMED, UNUSABLE, Beams, ScanFigures

Floats = NDArray[np.float64]

RANGE_M: Final = 4.0
"""Range up to which unseen ground counts."""
SPACING_M: Final = 0.1
"""Distance between points along an edge."""
_DEPTH_M: Final = 0.3
"""Difference between the ranges of neighbours from which on there is unseen ground between them."""


@kernel
def _seen_m(lidar: ScanFigures, beams: Beams, i: int) -> float:
    """Range up to which a beam has seen the ground free."""
    if beams.kind[i] == UNUSABLE:
        return 0.0
    if beams.kind[i] == NOTHING or beams.kind[i] == UNCONFIRMED:
        return min(lidar.dark_m, RANGE_M)
    seen_m: float = min(beams.range_m[i], RANGE_M)
    return seen_m


@kernel
def _put_edge(beams: Beams, i: int, from_m: float, to_m: float, points: Floats, count: int) -> int:
    """Put points along a beam; return the number of points so far."""
    ray, steps = beams.rays[i], math.ceil((to_m - from_m) / SPACING_M)
    for k in range(steps + 1):
        if count < len(points):
            far = from_m + (to_m - from_m) * k / max(steps, 1)
            points[count, 0], points[count, 1] = ray[0] + far * ray[2], ray[1] + far * ray[3]
            count += 1
    return count


@borrowing
def unseen_edges(lidars: Sequence[ScanFigures], beams: Beams, points: Floats) -> int:
    """Find the edges of unseen ground, up to RANGE_M from the lidar.

    A thing that comes out of unseen ground crosses such an edge, or the seen thing in front of it.

    Args:
        lidars: (1,) data sheet.
        beams: The scan, with its kinds.
        points: (n, 2) filled with points at most SPACING_M apart.

    Returns:
        Number of points.
    """
    lidar, last, count = lidars[0], len(beams.kind) - 1, 0
    if not lidar.round:
        count = _put_edge(beams, 0, lidar.min_m, _seen_m(lidar, beams, 0), points, count)
        count = _put_edge(beams, last, lidar.min_m, _seen_m(lidar, beams, last), points, count)
    for i in range(len(beams.kind)):
        j = i + 1 if i < last else 0
        if j == 0 and not lidar.round:
            continue
        a, b = _seen_m(lidar, beams, i), _seen_m(lidar, beams, j)
        if abs(a - b) > _DEPTH_M:
            # Along the beam that sees farther: there the unseen ground behind the nearer thing begins.
            count = _put_edge(beams, i if a > b else j, min(a, b), max(a, b), points, count)
    return count
