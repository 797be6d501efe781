"""How far the estimate is from the truth, as running sums."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from schemas.jit import kernel
from services.robot_sim.frames import Estimate
from services.robot_sim.world.world import Pose

COUNT: Final = 0
POSITION: Final = 1  # m²
HEADING: Final = 2  # rad²
SUMS: Final = 3

MOVING_MPS: Final = 0.01


@kernel
def enter_error(
    sums: NDArray[np.float64],
    speed_mps: float,
    truth: tuple[float, float, float],
    estimate: tuple[float, float, float],
) -> None:
    """Enter a tick in `sums` (SUMS,): true speed, true and estimated (east [m], north [m], heading [rad])."""
    if sums[COUNT] == 0.0 and abs(speed_mps) < MOVING_MPS:
        return
    east, north, turn = estimate[0] - truth[0], estimate[1] - truth[1], estimate[2] - truth[2]
    turn = math.pi - (math.pi - turn) % (2.0 * math.pi)
    sums[COUNT] += 1.0
    sums[POSITION] += east * east + north * north
    sums[HEADING] += turn * turn


class EstimatorError:
    """The estimate against the truth, from the first motion of a traversal to its end.

    Attributes:
        sums: (SUMS,) for kernels.
    """

    def __init__(self) -> None:
        """Start empty."""
        self.sums: NDArray[np.float64] = np.zeros(SUMS)

    def add(self, truth: Pose, speed_mps: float, estimate: Estimate) -> None:
        """Enter one tick."""
        enter_error(self.sums, speed_mps, tuple(truth), estimate[:3])

    @property
    def position_rmse_m(self) -> float:
        """Root mean square of the distance."""
        return self._root_mean(POSITION)

    @property
    def heading_rmse_rad(self) -> float:
        """Root mean square of the heading error."""
        return self._root_mean(HEADING)

    def _root_mean(self, quantity: int) -> float:
        count = float(self.sums[COUNT])
        return math.sqrt(float(self.sums[quantity]) / count) if count else 0.0
