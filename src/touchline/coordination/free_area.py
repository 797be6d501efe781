"""Area in which a team drives: a polygon, convex or not, less its obstacles, prepared for cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.robust_overlay import difference, union
from touchline.schemas.errors import SpecError

if TYPE_CHECKING:
    from shapely.geometry import Polygon as Shape

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Point = tuple[float, float]

# A side counts as straight with another if no corner lies farther (m) on its wrong side.
_STRAIGHT_M: Final = 1e-9


@dataclass(frozen=True)
class FreeArea:
    """Polygonal area; all its data are in the map frame, corners counter-clockwise.

    Attributes:
        hull: (c, 2) corners of its convex hull (m).
        sides: (h, 3) half-planes n·q ≤ offset of its sides that lie on the hull: outward unit normal, offset (m).
        walls: (e, 4) x₁ y₁ x₂ y₂ of all other sides, those of obstacles included (m).
        pieces: (p, m, 2) corners of convex pieces that it consists of (m): itself, or triangles.
        sizes: (p,) number of corners of each piece.
        area_m2: Its area.
        shape: The polygon itself.
    """

    hull: Floats
    sides: Floats
    walls: Floats
    pieces: Floats
    sizes: Ints
    area_m2: float
    shape: Shape

    @classmethod
    def of(cls, outline: Sequence[Point], obstacles: Sequence[Sequence[Point]] = ()) -> FreeArea:
        """Prepare an area.

        Args:
            outline: Corners, in either direction (m, map frame).
            obstacles: Corners of each.

        Raises:
            SpecError: A polygon crosses itself, or the rest is not one connected area.
        """
        import shapely

        rings = {"outline": outline} | {f"obstacles[{number}]": ring for number, ring in enumerate(obstacles)}
        shapes = [_polygon(name, ring) for name, ring in rings.items()]
        left: Any = difference(shapes[0], union(shapes[1:])) if obstacles else shapes[0]
        if left.geom_type != "Polygon" or left.is_empty:
            raise SpecError("area", "obstacles", "leave nothing, or several areas", "leave one connected area")
        whole = shapely.orient_polygons(left)
        hull = _corners(shapely.orient_polygons(whole.convex_hull))
        sides, walls = _sides(whole, hull)
        pieces, sizes = _stacked([_corners(whole)] if not len(walls) else _triangles(whole))
        return cls(hull, sides, walls, pieces, sizes, float(whole.area), whole)

    def holds(self, places: Floats, radius_m: float | Floats) -> NDArray[np.bool_]:
        """Return whether discs lie in the area.

        Args:
            places: (n, 2) of their middles (m, map frame).
            radius_m: Of all, or (n,) of each.

        Returns:
            (n,)
        """
        import shapely

        off_m = shapely.distance(self.shape.boundary, shapely.points(places))
        found: NDArray[np.bool_] = shapely.contains_xy(self.shape, places) & (off_m >= radius_m)
        return found


def _polygon(name: str, ring: Sequence[Point]) -> Shape:
    """Convert a ring to a polygon.

    Raises:
        SpecError: It is invalid.
    """
    import shapely

    if len(ring) < 3 or not np.isfinite(np.asarray(ring, dtype=np.float64)).all():
        raise SpecError("area", name, "is no polygon", "give at least three corners, finite numbers (m)")
    shape = shapely.Polygon(ring)
    if not shape.is_valid or shape.area == 0.0:
        raise SpecError("area", name, "crosses itself or has no inside", "give the corners in order, either way round")
    return shape


def _corners(shape: Any) -> Floats:
    """Return (c, 2) a polygon's outline, without the first corner again at the end."""
    return np.array(shape.exterior.coords, dtype=np.float64)[:-1, :2]


def _sides(whole: Shape, hull: Floats) -> tuple[Floats, Floats]:
    """Return half-planes of sides that have the whole area on one side, and walls: all other sides."""
    sides, walls = [], []
    for ring in (whole.exterior, *whole.interiors):
        corners = np.array(ring.coords, dtype=np.float64)[:, :2]
        for a, b in pairwise(corners):
            along = (b - a) / np.hypot(*(b - a))
            normal = np.array((along[1], -along[0]))
            if (hull @ normal).max() <= normal @ a + _STRAIGHT_M:
                sides.append((*normal, normal @ a))
            else:
                walls.append((*a, *b))
    return np.array(sides, dtype=np.float64).reshape(-1, 3), np.array(walls, dtype=np.float64).reshape(-1, 4)


def _triangles(whole: Shape) -> list[Floats]:
    """Return triangles of all of the area, between its own corners."""
    import shapely

    found = shapely.constrained_delaunay_triangles(whole)
    return [_corners(shapely.orient_polygons(triangle)) for triangle in found.geoms]


def _stacked(pieces: list[Floats]) -> tuple[Floats, Ints]:
    """Return pieces in one array, and the number of corners of each."""
    sizes = np.array([len(piece) for piece in pieces], dtype=np.int64)
    stacked = np.zeros((len(pieces), int(sizes.max()), 2))
    for row, piece in zip(stacked, pieces, strict=True):
        row[: len(piece)] = piece
    return stacked, sizes
