"""Division of an area's points among robots by the shortest way, round corners where the area is not convex.

Where robots see all points this is the Voronoi partition. Elsewhere distances are *geodesic*: of ways that keep clear
of walls. Pimenta, Kumar, Mesquita, Pereira, "Sensing and coverage for a network of heterogeneous robots", CDC 2008;
Bhattacharya, Ghrist, Kumar, "Multi-robot coverage and exploration on Riemannian manifolds with boundaries",
International Journal of Robotics Research 33(1), 2014.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.free_area import FreeArea
from touchline.coordination.geodesics import PITCH_M, Geodesics
from touchline.coordination.kernels.geodesic_fields import FreeGrid, GeodesicField, fill_field

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Complexes = NDArray[np.complex128]

_MOST_NODES: Final = 40_000
"""Points of the grid of a large area: their distance grows beyond that of small ones."""


class Shares(NamedTuple):
    """Shares of robots in k points.

    Attributes:
        owners: (k,) number of the robot whose way to each is shortest; −1: no way leads there.
        leads: (k, 2) end of the first straight part of that way (m, map frame): the point, if it is seen.
        lengths_m: (k,) length of the way.
        stretch: (k,) that length over the length of the first part: 1 if the point is seen.
    """

    owners: Ints
    leads: Floats
    lengths_m: Floats
    stretch: Floats


class PointShares:
    """Division of some points of an area, again and again.

    A point that robots cannot reach, as it is near a wall, counts as the nearest one that they can.
    """

    def __init__(self, area: FreeArea, wall_m: float, points: Floats) -> None:
        """Divide points.

        Args:
            area: The area.
            wall_m: Distance that ways keep from walls, where the area is not convex.
            points: (k, 2) m, map frame.
        """
        from scipy.spatial import KDTree

        self.points = points
        self.geodesics: Geodesics | None = None
        if len(area.walls):
            self.geodesics = Geodesics(area, wall_m, pitch_of(area))
            nodes = self.geodesics.nodes
            self._tree = KDTree(np.column_stack((nodes.real, nodes.imag)))
            self._at = self._tree.query(points)[1]

    def of(self, places: Floats) -> Shares:
        """Return the shares of robots at places (n, 2) (m, map frame)."""
        if self.geodesics is None:
            off_m = np.linalg.norm(self.points[:, None] - places, axis=2)
            owners = off_m.argmin(axis=1)
            return Shares(owners, self.points, off_m[np.arange(len(owners)), owners], np.ones(len(owners)))
        starts = self._on_grid(self.geodesics, places)
        field = _field(self.geodesics, starts)
        owners, leads, lengths_m = field.owners[self._at], field.leads[self._at], field.lengths_m[self._at]
        first_m = np.abs(leads - starts[owners])
        stretch = np.divide(lengths_m, first_m, out=np.ones(len(owners)), where=(first_m > 0.0) & (owners >= 0))
        return Shares(owners, np.column_stack((leads.real, leads.imag)), lengths_m, stretch)

    def _on_grid(self, geodesics: Geodesics, places: Floats) -> Complexes:
        """Return (n,) places, x + iy (m); for one that is not on the free grid, the nearest that is."""
        nodes = geodesics.nodes
        off_m, nearest = self._tree.query(places)
        found: Complexes = places[:, 0] + 1j * places[:, 1]
        return np.where(off_m > math.sqrt(0.5) * geodesics.pitch_m, nodes[nearest], found)


def pitch_of(area: FreeArea) -> float:
    """Return the distance of neighbours on the grid of an area (m)."""
    return max(PITCH_M, math.sqrt(area.area_m2 / _MOST_NODES))


def _field(geodesics: Geodesics, starts: Complexes) -> GeodesicField:
    nodes = geodesics.nodes
    n = len(nodes)
    leads, anchors = np.zeros(n, dtype=np.complex128), np.zeros(n, dtype=np.complex128)
    field = GeodesicField(np.zeros(n, dtype=np.int64), np.zeros(n), leads, anchors, np.zeros(n))
    grid = FreeGrid(geodesics.number, nodes, geodesics.rows, geodesics.corner, geodesics.pitch_m)
    fill_field(grid, starts, field)
    return field
