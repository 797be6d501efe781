"""Lines and arcs in kernels: one formula, with points as complex numbers x + iy (m).

Along an arc of curvature κ the chord of arc length s has length s·sin(κs/2)/(κs/2), and lies at half the turn κs. A
line is an arc of curvature 0. `schemas.curves` has the same for whole arrays outside kernels.
"""

import math

import numpy as np
from numpy.typing import NDArray

from touchline.core.angles import nearest_turn
from touchline.core.jit import kernel

Floats = NDArray[np.float64]
# Columns of a line or arc: start (m), heading (rad), curvature (1/m, left positive), length (m); more may follow.
X, Y, HEADING, CURVATURE, LENGTH = range(5)


@kernel
def unit(angle_rad: float) -> complex:
    """Unit vector at an angle from +x."""
    return complex(math.cos(angle_rad), math.sin(angle_rad))


@kernel
def chord_share(half_turn_rad: float) -> float:
    """Ratio of the chord to an arc that turns by twice the angle: sin(x) / x."""
    return math.sin(half_turn_rad) / half_turn_rad if half_turn_rad != 0.0 else 1.0


@kernel
def arc(heading_rad: float, curvature_1pm: float, length_m: float) -> tuple[complex, float]:
    """Displacement and turn along an arc or a line.

    Args:
        heading_rad: Heading at its start, from +x.
        curvature_1pm: Curvature, left positive; 0 for a line.
        length_m: Arc length; negative is backward.

    Returns:
        The chord x + iy (m), in the frame of the heading, and the turn (rad).
    """
    half = 0.5 * curvature_1pm * length_m
    return unit(heading_rad + half) * (length_m * chord_share(half)), 2.0 * half


@kernel
def beside(point: complex, row: Floats, facing: complex) -> float:
    """Signed distance (m) of a point from a line or arc that extends beyond its ends, left positive.

    Args:
        point: Point in the frame of the row, m.
        row: (5 or more,) X to LENGTH.
        facing: Unit vector of its heading, precomputed for many points.
    """
    dx, dy = point.real - row[X], point.imag - row[Y]
    left: float = facing.real * dy - facing.imag * dx
    k = row[CURVATURE]
    if k == 0.0:
        return left
    radius = 1.0 / k
    ahead, inward = facing.real * dx + facing.imag * dy, radius - left
    return float((abs(radius) - math.sqrt(ahead * ahead + inward * inward)) * math.copysign(1.0, k))


@kernel
def abreast(point: complex, row: Floats, facing: complex) -> float:
    """Arc length (m) at which a line or arc that extends beyond its ends is nearest to a point.

    An arc passes there once per turn; the pass nearest to the middle of its length counts.

    Args:
        point: Point in the frame of the row, m.
        row: (5 or more,) X to LENGTH.
        facing: Unit vector of its heading, precomputed for many points.
    """
    dx, dy = point.real - row[X], point.imag - row[Y]
    ahead: float = facing.real * dx + facing.imag * dy
    k = row[CURVATURE]
    if k == 0.0:
        return ahead
    angle = math.atan2(ahead, (1.0 / k - (facing.real * dy - facing.imag * dx)) * math.copysign(1.0, k))
    return float(nearest_turn(angle, 0.5 * row[LENGTH] * abs(k)) / abs(k))
