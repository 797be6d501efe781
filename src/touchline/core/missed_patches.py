"""Pieces of ground that were left out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

SMALLEST_M2: Final = 0.05
"""Smaller ones are not listed."""


class Patch(NamedTuple):
    """A place that was left out: a point inside it, and its size."""

    x_m: float
    y_m: float
    area_m2: float


def patches(missed: BaseGeometry) -> list[Patch]:
    """The pieces of what was missed that are not too small, the largest first."""
    import shapely

    large = [part for part in shapely.get_parts(missed).tolist() if part.area > SMALLEST_M2]
    inside = [(part.representative_point(), float(part.area)) for part in large]
    found = [Patch(float(point.x), float(point.y), area) for point, area in inside]
    return sorted(found, key=lambda patch: (-patch.area_m2, patch.x_m, patch.y_m))
