"""Coverage of an area by a team: what it costs, and where robots go to make it cost less.

In a convex area this is Lloyd's rule (`lloyd.py`). In others distances d are geodesic, so H = Σ ∫ d(p_i, q)²·φ(q) dq
over the cells, with points of a grid for the integral, and a centroid is not defined: −∂H/∂p_i = 2 ∫ d·φ·u dq, u the
direction in which the way from p_i to q begins. With ρ the length of the first straight part of that way, which ends at
b, d² is at most |p − b|²·d/ρ and a constant, with equality at p_i (Weiszfeld's bound for the rest of the way). The mean
of all b, weighted by φ·d/ρ, is the least point of that bound. It lies in the direction of −∂H, and a step to it never
costs more, as long as the way there is straight and the ends b are seen from it. If all is seen, it is the centroid.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.density import Density
from touchline.coordination.free_area import FreeArea
from touchline.coordination.lloyd import STILL_M, Deployment, deployment, relaxed_targets
from touchline.coordination.point_shares import PointShares, Shares, pitch_of

Floats = NDArray[np.float64]


class TeamCoverage(Protocol):
    """Rule by which a team covers an area."""

    def deployment(self, points: Floats) -> Deployment:
        """Return centroids and cost of points (n, 2) (m, map frame)."""
        ...

    def goals(self, points: Floats) -> Floats:
        """Return (n, 2) where robots at points (n, 2) go next (m, map frame)."""
        ...


def coverage_of(area: FreeArea, density: Density, wall_m: float) -> TeamCoverage:
    """Return the rule for an area.

    Args:
        area: The area.
        density: φ.
        wall_m: Distance that robots keep from walls.
    """
    return GeodesicCoverage(area, density, wall_m) if len(area.walls) else _StraightCoverage(area, density)


class _StraightCoverage:
    """Lloyd's rule in a convex area."""

    def __init__(self, area: FreeArea, density: Density) -> None:
        self._area, self._density = area, density

    def deployment(self, points: Floats) -> Deployment:
        """Return centroids and cost, as of `TeamCoverage`.

        Raises:
            CoincidentPoints: Two points are the same.
        """
        return deployment(points, self._area, self._density)

    def goals(self, points: Floats) -> Floats:
        """Return goals, as of `TeamCoverage`.

        Raises:
            CoincidentPoints: Two points are the same.
        """
        return relaxed_targets(points, self.deployment(points).centroids)


class GeodesicCoverage:
    """Lloyd's rule by geodesic distances."""

    def __init__(self, area: FreeArea, density: Density, wall_m: float) -> None:
        """Cover an area.

        Args:
            area: The area, not convex.
            density: φ.
            wall_m: Distance that robots keep from walls.
        """
        pitch_m = pitch_of(area)
        low, high = area.hull.min(axis=0), area.hull.max(axis=0)
        column, row = np.meshgrid(*(np.arange(n) for n in np.ceil((high - low) / pitch_m)))
        samples = low + pitch_m * (np.column_stack((column.ravel(), row.ravel())) + 0.5)
        samples = samples[area.holds(samples, 0.0)]
        self._shares = PointShares(area, wall_m, samples)
        self._masses = pitch_m * pitch_m * np.array([density.at(x, y) for x, y in samples.tolist()])

    def deployment(self, points: Floats) -> Deployment:
        """Return the least points of the bound, instead of centroids, and the cost, as of `TeamCoverage`."""
        return self._deployment(points, self._shares.of(points))

    def goals(self, points: Floats) -> Floats:
        """Return goals that are seen from where robots are, as of `TeamCoverage`."""
        shares, geodesics = self._shares.of(points), self._shares.geodesics
        assert geodesics is not None, "the area is not convex"
        centroids = self._deployment(points, shares).centroids
        relaxed = relaxed_targets(points, centroids)
        found = np.empty_like(points)
        for who, (place, *ahead) in enumerate(zip(points, relaxed, centroids, strict=True)):
            seen = (goal for goal in ahead if geodesics.sees(complex(*place), complex(*goal)))
            goal = next(seen, None)
            found[who] = self._nearest_seen(shares, who, place, centroids[who]) if goal is None else goal
        return found

    def _deployment(self, points: Floats, shares: Shares) -> Deployment:
        owned = shares.owners >= 0
        owners, masses = shares.owners[owned], self._masses[owned]
        weights = masses * shares.stretch[owned]
        mass, *first = (
            np.bincount(owners, each, len(points)) for each in (weights, *(weights * shares.leads[owned].T))
        )
        centroids = np.divide(np.transpose(first), mass[:, None], out=points.copy(), where=mass[:, None] > 0.0)
        return Deployment(centroids, float(masses @ shares.lengths_m[owned] ** 2))

    @staticmethod
    def _nearest_seen(shares: Shares, who: int, place: Floats, wanted: Floats) -> Floats:
        """Return the point of a robot's share that it sees and that is nearest to where it would go: along a wall."""
        seen = shares.leads[(shares.owners == who) & (shares.stretch == 1.0)]
        off_m = np.hypot(*(seen - wanted).T)
        if not len(seen) or off_m.min() > np.hypot(*(place - wanted)) - STILL_M:
            return place
        nearest: Floats = seen[int(off_m.argmin())]
        return nearest
