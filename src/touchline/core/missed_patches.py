"""Missed patches of ground."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

SMALLEST_M2: Final = 0.05
"""Size below which a patch is not listed."""


class Patch(NamedTuple):
    """Missed patch: a point inside it, and its area."""

    x_m: float
    y_m: float
    area_m2: float


def patches(missed: BaseGeometry) -> list[Patch]:
    """List the patches of missed ground from `SMALLEST_M2` on, the largest first."""
    import shapely

    large = [part for part in shapely.get_parts(missed).tolist() if part.area > SMALLEST_M2]
    inside = [(part.representative_point(), float(part.area)) for part in large]
    found = [Patch(float(point.x), float(point.y), area) for point, area in inside]
    return sorted(found, key=lambda patch: (-patch.area_m2, patch.x_m, patch.y_m))
