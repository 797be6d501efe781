"""Density φ, the importance of being near to a place, of three kinds, each with exact moments.

A density that is uniform, or uniform over discs or over the squares of a raster, has moments in closed form over any
polygon, so there is no quadrature, and no error but rounding.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.cells import VoronoiParts
from touchline.coordination.kernels.polygon_moments import disc_moments, even_moments, raster_moments
from touchline.schemas.team import Importance

Floats = NDArray[np.float64]


class Density(Protocol):
    """φ ≥ 0 over the area; 1/m² if its integral is to be dimensionless."""

    def at(self, x_m: float, y_m: float) -> float:
        """Return φ at a place (map frame)."""
        ...

    def moments(self, parts: VoronoiParts, points: Floats) -> Floats:
        """Return moments of cells, each about its own point.

        Args:
            parts: Of n cells.
            points: (n, 2) m, map frame.

        Returns:
            (n, 4) mass M = ∫φ, first moment ∫(q − p)φ (x and y), second moment ∫|q − p|²φ.
        """
        ...


@dataclass(frozen=True)
class EvenDensity:
    """Uniform density over the area."""

    value: float = 1.0

    def at(self, x_m: float, y_m: float) -> float:
        """Return φ at a place, as of `Density`."""
        return self.value

    def moments(self, parts: VoronoiParts, points: Floats) -> Floats:
        """Return moments of cells, as of `Density`."""
        found: Floats = even_moments(parts.corners, parts.counts, points, self.value)
        return found


@dataclass(frozen=True)
class DiscDensity:
    """Constant density plus discs; where discs overlap their values add up.

    Attributes:
        discs: x, y, radius (m) and added value of each.
        value: Constant; it may be 0: a robot whose cell is empty then stays where it is.
    """

    discs: tuple[tuple[float, float, float, float], ...]
    value: float = 1.0

    def at(self, x_m: float, y_m: float) -> float:
        """Return φ at a place, as of `Density`."""
        inside = (value for x, y, radius_m, value in self.discs if math.hypot(x_m - x, y_m - y) <= radius_m)
        return self.value + sum(inside)

    def moments(self, parts: VoronoiParts, points: Floats) -> Floats:
        """Return moments of cells, as of `Density`."""
        rows = np.array(self.discs, dtype=np.float64).reshape(-1, 4)
        even: Floats = even_moments(parts.corners, parts.counts, points, self.value)
        more: Floats = disc_moments(parts.corners, parts.counts, points, rows)
        return even + more


@dataclass(frozen=True)
class RasterDensity:
    """Density of the squares of a raster, and 0 outside it.

    Attributes:
        values: (rows, columns), row by row along y from the origin.
        pixel_m: Side of a square.
        origin_m: x and y of the corner of least x and y.
    """

    values: Floats
    pixel_m: float
    origin_m: tuple[float, float] = (0.0, 0.0)

    def at(self, x_m: float, y_m: float) -> float:
        """Return φ at a place, as of `Density`."""
        column = math.floor((x_m - self.origin_m[0]) / self.pixel_m)
        row = math.floor((y_m - self.origin_m[1]) / self.pixel_m)
        rows, columns = self.values.shape
        return float(self.values[row, column]) if 0 <= row < rows and 0 <= column < columns else 0.0

    def moments(self, parts: VoronoiParts, points: Floats) -> Floats:
        """Return moments of cells, as of `Density`."""
        origin = complex(*self.origin_m)
        found: Floats = raster_moments(parts.corners, parts.counts, points, origin, self.pixel_m, self.values)
        return found


def density_of(importance: Importance) -> Density:
    """Return the density of a specification."""
    raster = importance.raster
    if raster is not None:
        return RasterDensity(np.array(raster.values, dtype=np.float64), raster.pixel_m, (raster.x_m, raster.y_m))
    if importance.discs:
        return DiscDensity(
            tuple((disc.x_m, disc.y_m, disc.radius_m, disc.value) for disc in importance.discs), importance.value
        )
    return EvenDensity(importance.value)
