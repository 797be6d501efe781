"""Angles and whole turns."""

import math

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel

TAU = 2.0 * math.pi


@kernel
def wrapped(angle_rad: float) -> float:
    """Wrap an angle (rad) to (−π, π]."""
    return math.pi - (math.pi - angle_rad) % TAU


@kernel
def nearest_turn(angle_rad: float, middle_rad: float) -> float:
    """Shift an angle by whole turns to within half a turn of another.

    Args:
        angle_rad: Angle to shift.
        middle_rad: Angle that it is to be near to.

    Returns:
        The angle in [middle − π, middle + π), rad.
    """
    return angle_rad - TAU * math.floor((angle_rad - middle_rad) / TAU + 0.5)


@kernel
def sinc(angle_rad: float) -> float:
    """Compute sin(x) / x, 1 at 0."""
    return math.sin(angle_rad) / angle_rad if abs(angle_rad) > 1e-6 else 1.0


def wrapped_all(angle_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Wrap angles (rad), of any shape, to [−π, π]."""
    return np.asarray(np.angle(np.exp(1j * angle_rad)))
