"""Error of the estimate against the truth, as running sums."""

from __future__ import annotations

import math
from collections.abc import Sequence
from operator import add
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.angles import wrapped
from touchline.core.jit import kernel
from touchline.onboard.interface import Estimate
from touchline.services.robot_sim.world.world import TruePose

COUNT: Final = 0
POSITION: Final = 1  # m²
HEADING: Final = 2  # rad²
SUMS: Final = 3

NO_ERROR: Final = (0.0,) * SUMS

MOVING_MPS: Final = 0.01


@kernel
def enter_error(
    sums: NDArray[np.float64],
    speed_mps: float,
    truth: tuple[float, float, float],
    estimate: tuple[float, float, float],
) -> None:
    """Add a tick: the squares of distance and heading error; nothing before the robot first moves.

    Args:
        sums: (SUMS,) updated.
        speed_mps: True speed.
        truth: East [m], north [m], heading [rad], map frame.
        estimate: The same, estimated.
    """
    if sums[COUNT] == 0.0 and abs(speed_mps) < MOVING_MPS:
        return
    east, north, turn = estimate[0] - truth[0], estimate[1] - truth[1], estimate[2] - truth[2]
    turn = wrapped(turn)
    sums[COUNT] += 1.0
    sums[POSITION] += east * east + north * north
    sums[HEADING] += turn * turn


class EstimatorError:
    """Error of the estimate, from the first motion of a traversal to its end.

    Args:
        before: Sums of the part of the traversal that another process has driven.

    Attributes:
        sums: (SUMS,) for kernels; without those `before`, since a count means that the robot has moved.
    """

    def __init__(self, before: Sequence[float] = NO_ERROR) -> None:
        self._before = tuple(before)
        self.sums: NDArray[np.float64] = np.zeros(SUMS)

    @property
    def totals(self) -> tuple[float, ...]:
        """Sums (SUMS,), those before included."""
        return tuple(map(add, self._before, self.sums.tolist()))

    def add(self, truth: TruePose, speed_mps: float, estimate: Estimate) -> None:
        """Add one tick.

        Args:
            truth: True pose.
            speed_mps: True speed.
            estimate: Estimate of the same tick.
        """
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
        totals = self.totals
        return math.sqrt(totals[quantity] / totals[COUNT]) if totals[COUNT] else 0.0
