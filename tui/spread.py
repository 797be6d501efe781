"""Ellipse of a position's uncertainty."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from touchline.tui.raster import Polyline

SIGMAS = 3.0
_CORNERS = 72


@dataclass(frozen=True)
class Spread:
    """Semi-axes of the 3σ ellipse in metres, and the direction of the longer one in the map frame."""

    long_m: float
    short_m: float
    angle_rad: float

    @classmethod
    def of(cls, covariance: NDArray[np.float64]) -> Spread | None:
        """Compute the ellipse of a pose; the semi-axes are 3 √λ of the eigenvalues λ of the covariance of x and y.

        Args:
            covariance: (36,) row-major over x, y, z (m) and the rotations about them (rad), in the map frame.

        Returns:
            The ellipse; None if the covariance is unknown: all 0, not finite, or not valid.
        """
        xx, xy, yy = float(covariance[0]), float(covariance[1]), float(covariance[7])
        mean, half = (xx + yy) / 2, math.hypot((xx - yy) / 2, xy)
        if not (0.0 < mean < math.inf and half <= mean * (1 + 1e-9)):
            return None
        angle = math.atan2(2 * xy, xx - yy) / 2
        return cls(SIGMAS * math.sqrt(mean + half), SIGMAS * math.sqrt(max(mean - half, 0.0)), angle)

    def outline(self, x_m: float, y_m: float) -> Polyline:
        """Outline of the ellipse about a point."""
        turn = np.linspace(0.0, 2 * math.pi, _CORNERS + 1)
        along, across = self.long_m * np.cos(turn), self.short_m * np.sin(turn)
        cos, sin = math.cos(self.angle_rad), math.sin(self.angle_rad)
        x, y = x_m + cos * along - sin * across, y_m + sin * along + cos * across
        return Polyline(x, y, np.arange(len(turn)) > 0)
