"""Clothoids in place of a cubic curve.

Not compiled as a whole: to compile what solves equations and interpolates takes longer than all else of a curve.
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

# Newton's method ends so near to the goal (a share of the length), or after so many steps.
MET: Final = 1e-14
NEWTON_STEPS: Final = 6


class Clothoids(NamedTuple):
    """Clothoids in place of a curve.

    Attributes:
        at: (n + 1,) the curve's parameter s at their borders.
        length: (n,) of each (m).
        curvature: (n + 1,) at their borders (1/m), as travelled.
        off: How far (m) they are off the curve at their borders at most.
    """

    at: Floats
    length: Floats
    curvature: Floats
    off: float


def borders(curve: CubicCurve, cells: int) -> Floats:
    """(cells + 1,) values of s that part a curve into cells with equal shares of its length, its turn and its twist.

    Args:
        curve: That is parted.
        cells: How many.
    """
    behind = weights_along(curve)
    return np.interp(np.linspace(0.0, behind[-1], cells + 1), behind, np.linspace(0.0, 1.0, FINE + 1))


def clothoids(curve: CubicCurve, cells: int) -> Clothoids:
    """Clothoids in place of a curve, from its start to its goal with its headings there.

    Their lengths are the curve's between their borders, and their curvature is that continuous and piecewise linear one
    which is nearest to the curve's in the mean square: so its integrals, heading and place, stay nearer than if it were
    the curve's own at the borders. All but for a linear change of curvature and a change of scale, which Newton's
    method finds so that they end where the curve does.

    Args:
        curve: As travelled.
        cells: How many of them.
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
