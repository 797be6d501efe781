"""Deployment by Lloyd's rule: every robot goes towards the centroid of its Voronoi cell.

The cost H = Σ ∫ |q − p_i|²·φ(q) dq over the cells never rises if every robot goes to the centroid C_i, as its
derivative is 2·M_i·(p_i − C_i): Cortés, Martínez, Karatas, Bullo, "Coverage control for mobile sensing networks", IEEE
Transactions on Robotics and Automation 20(2), 2004. Near the end that is slow; the over-relaxed target p + 1.7·(C − p)
is faster, and ends at a lower cost if one goes on until every centroid is within a centimetre.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.cells import voronoi
from touchline.coordination.density import Density, EvenDensity
from touchline.coordination.free_area import FreeArea
from touchline.coordination.kernels.polygon_moments import FIRST_X, MASS, SECOND

Floats = NDArray[np.float64]

RELAXATION: Final = 1.7
STILL_M: Final = 0.01
"""A robot nearer to its centroid than this stays."""
EVEN: Final = EvenDensity()


class Deployment(NamedTuple):
    """Spread of points over an area.

    Attributes:
        centroids: (n, 2) of their cells (m, map frame); for a cell without mass, the point itself.
        cost: H (m⁴, if the density has no unit).
    """

    centroids: Floats
    cost: float


def deployment(points: Floats, area: FreeArea, density: Density = EVEN) -> Deployment:
    """Return centroids and cost.

    Args:
        points: (n, 2) m, map frame.
        area: The area.
        density: φ.

    Raises:
        CoincidentPoints: Two points are the same.
    """
    moments = density.moments(voronoi(points, area), points)
    mass = moments[:, MASS : MASS + 1]
    first = moments[:, FIRST_X : FIRST_X + 2]
    offset = np.divide(first, mass, out=np.zeros_like(first), where=mass > 0.0)
    return Deployment(points + offset, float(moments[:, SECOND].sum()))


def square_cost(robots: int, area_m2: float) -> float:
    """Return H_□ = N·a⁴/6 (m⁴): the cost of robots in the middles of squares of side a = √(area/N), of density 1."""
    return area_m2 * area_m2 / (6.0 * robots)


def relaxed_targets(points: Floats, centroids: Floats) -> Floats:
    """Return targets: p + 1.7·(C − p), or p itself, if the centroid is within a centimetre.

    Args:
        points: (n, 2) m.
        centroids: (n, 2) m.

    Returns:
        (n, 2) m; possibly outside the cell and the area.
    """
    step = centroids - points
    moving = np.hypot(step[:, 0], step[:, 1]) >= STILL_M
    return points + RELAXATION * step * moving[:, None]


def settled(points: Floats, area: FreeArea, density: Density = EVEN, rounds: int = 2000) -> Floats:
    """Return the final places of points that jump by Lloyd's rule: the reference for a team of robots.

    Args:
        points: (n, 2) starts (m, map frame).
        area: The area; convex, else a target may lie outside it.
        density: φ.
        rounds: Most rounds.

    Returns:
        (n, 2) m, map frame.

    Raises:
        CoincidentPoints: Two points are the same.
    """
    for _ in range(rounds):
        after = relaxed_targets(points, deployment(points, area, density).centroids)
        if np.array_equal(after, points):
            break
        points = np.clip(after, area.hull.min(axis=0), area.hull.max(axis=0))
    return points
