"""Motion over time in kernels: samples of pose and twist at fixed steps, straight lines between them."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel

Floats = NDArray[np.float64]

# Columns of a sample: place (m), heading (rad, not wrapped), speed (m/s), yaw rate (rad/s).
X, Y, HEADING, SPEED, YAW_RATE = range(5)
COLUMNS: Final = 5
STEP_S: Final = 0.05


@kernel
def motion_at(samples: Floats, time_s: float, found: Floats) -> None:
    """Interpolate a motion; it stays at its first sample before, and at its last one after.

    Args:
        samples: (m, 5), `STEP_S` apart.
        time_s: Time since the first.
        found: (5,) filled in.
    """
    at = min(max(time_s / STEP_S, 0.0), len(samples) - 1.0)
    k = min(int(at), len(samples) - 2)
    share = at - k
    for column in range(COLUMNS):
        found[column] = (1.0 - share) * samples[k, column] + share * samples[k + 1, column]
