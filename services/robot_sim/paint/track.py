"""True path of the robot while it worked, and the amount of paint laid by then."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel

# Columns, one row whenever some point of the robot may have moved by `STEP_M`.
TRACK_TICK: Final = 0
TRACK_EAST: Final = 1
TRACK_NORTH: Final = 2
TRACK_HEADING: Final = 3
TRACK_POINTS: Final = 4  # of paint, in the ledger's count
TRACK_COLUMNS: Final = 5

STEP_M: Final = 0.02
REACH_M: Final = 0.7
"""Distance from the axle's middle by which the robot's rotation counts as motion: that distance per radian."""
_FIRST_ROWS: Final = 4096

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@kernel
def follow(tick: int, pose: tuple[float, float, float], points: int, rows: Floats, count: Integers) -> None:
    """Enter a tick, unless the robot has hardly moved.

    Args:
        tick: This tick.
        pose: True pose at its end, map frame: east [m], north [m], heading [rad].
        points: Number of points of paint by then.
        rows: (n, TRACK_COLUMNS) with room for one more.
        count: (1,) rows so far, updated.
    """
    at = count[0]
    if at > 0:
        last = rows[at - 1]
        moved = math.hypot(pose[0] - last[TRACK_EAST], pose[1] - last[TRACK_NORTH])
        if moved + REACH_M * abs(pose[2] - last[TRACK_HEADING]) < STEP_M:
            return
    rows[at, TRACK_TICK], rows[at, TRACK_POINTS] = tick, points
    rows[at, TRACK_EAST], rows[at, TRACK_NORTH], rows[at, TRACK_HEADING] = pose
    count[0] = at + 1


class Track:
    """Path of a traversal, or of the part of it that this process has driven: 40 bytes every 2 cm."""

    def __init__(self) -> None:
        """Begin without rows."""
        self._rows: Floats = np.zeros((_FIRST_ROWS, TRACK_COLUMNS))
        self._count: Integers = np.zeros(1, dtype=np.int64)

    def snapshot(self) -> Track:
        """Copy the path so far, for another thread to evaluate while the robot drives on."""
        frozen = Track()
        frozen._rows, frozen._count = self.rows.copy(), self._count.copy()
        return frozen

    def enter(self, tick: int, pose: tuple[float, float, float], points: int) -> None:
        """Enter one tick, as the kernel `follow`.

        Args:
            tick: This tick.
            pose: True pose at its end, map frame: east [m], north [m], heading [rad].
            points: Number of points of paint by then.
        """
        east_m, north_m, heading_rad = pose
        follow(tick, (east_m, north_m, heading_rad), points, *self.arrays(1))

    def arrays(self, ticks: int) -> tuple[Floats, Integers]:
        """Return rows and count, for `follow` to be called in so many ticks."""
        missing = int(self._count[0]) + ticks - len(self._rows)
        if missing > 0:
            self._rows = np.concatenate((self._rows, np.zeros((max(missing, len(self._rows)), TRACK_COLUMNS))))
        return self._rows, self._count

    @property
    def rows(self) -> Floats:
        """Rows (n, TRACK_COLUMNS) so far; a view."""
        return self._rows[: self._count[0]]
