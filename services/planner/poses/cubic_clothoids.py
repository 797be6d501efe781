"""Approximation of a cubic curve by clothoids.

Not compiled as a whole: compiling the solver and the interpolation would take longer than computing the curve.
"""

from typing import Final, NamedTuple

import numpy as np

from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.poses.kernels.cubic_curve import (
    FINE,
    CubicCurve,
    farthest_off,
    goal_ahead,
    miss,
    nearest_curvature,
    weights_along,
)

# Newton's method ends this near to the goal (fraction of the length), or after this many steps.
MET: Final = 1e-14
NEWTON_STEPS: Final = 6


class Clothoids(NamedTuple):
    """Clothoids that approximate a curve.

    Attributes:
        at: (n + 1,) parameter s of the curve at their borders.
        length: (n,) lengths (m).
        curvature: (n + 1,) curvature at their borders (1/m), as travelled.
        off: Maximum distance (m) from the curve at their borders.
    """

    at: Floats
    length: Floats
    curvature: Floats
    off: float


def borders(curve: CubicCurve, cells: int) -> Floats:
    """Values (cells + 1,) of s that divide a curve into cells of equal shares of its length, turn and twist.

    Args:
        curve: Curve to divide.
        cells: Number of cells.
    """
    behind = weights_along(curve)
    return np.interp(np.linspace(0.0, behind[-1], cells + 1), behind, np.linspace(0.0, 1.0, FINE + 1))


def clothoids(curve: CubicCurve, cells: int) -> Clothoids:
    """Approximate a curve by clothoids, from its start to its goal with its headings there.

    Their lengths are the curve's between their borders, and their curvature is the continuous, piecewise linear
    least-squares fit of the curve's: so its integrals, heading and position, stay nearer than with the curve's own
    values at the borders. Newton's method adds a linear change of curvature and a change of scale, so that they end
    where the curve does.

    Args:
        curve: Curve, as travelled.
        cells: Number of clothoids.
    """
    at = borders(curve, cells)
    length, curvature = nearest_curvature(curve, at)
    run = np.concatenate((np.zeros(1), np.cumsum(length)))
    total = run[-1]
    share = run / total
    goal, turn = goal_ahead(curve)
    change, steps, tuned = np.empty((3, 3)), (1e-6 / total, 1e-6 / total, 1e-6), np.zeros(3)
    for _ in range(NEWTON_STEPS):
        off = miss(length, curvature + tuned[0] + tuned[1] * share, 1.0 + tuned[2], goal, turn)
        if np.abs(off).max() < MET * total:
            break
        for k in range(3):
            other = tuned.copy()
            other[k] += steps[k]
            missed = miss(length, curvature + other[0] + other[1] * share, 1.0 + other[2], goal, turn)
            change[:, k] = (missed - off) / steps[k]
        tuned -= np.linalg.solve(change, off)
    length *= 1.0 + tuned[2]
    curvature += tuned[0] + tuned[1] * share
    return Clothoids(at, length, curvature, farthest_off(curve, at, length, curvature))
