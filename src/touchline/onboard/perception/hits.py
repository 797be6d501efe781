"""Points of things that the robot has seen: what perception hands to protection."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

NO_POINTS: Final[NDArray[np.float64]] = np.empty((0, 2))


class Hits(NamedTuple):
    """Points at which something is, or may be, by the last scans.

    Attributes:
        points_m: (n, 2) east and north, map frame [m].
        tick: Tick at whose end the oldest of them was measured.
        error_m: Bound on the error of each, 3 σ: range, bearing, and the robot's pose since.
        standing: Number of points, the last ones, that belong to outlines known to the plan: these things stand.
        doubtful_m: (m, 2) further points, which may be ground: a reason to slow down, not to stop.
    """

    points_m: NDArray[np.float64]
    tick: int
    error_m: float
    standing: int = 0
    doubtful_m: NDArray[np.float64] = NO_POINTS
