"""Points of things that the robot has seen: what perception hands to protection."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Hits(NamedTuple):
    """Points at which something is, or may be, by the last scans.

    Attributes:
        points_m: (n, 2) east and north, map frame [m].
        tick: Tick at whose end the oldest of them was measured.
        error_m: Bound on the error of each, 3 σ: range, bearing, and the robot's pose since.
    """

    points_m: NDArray[np.float64]
    tick: int
    error_m: float
