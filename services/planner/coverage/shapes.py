"""Areas in one piece or several, or none."""

import shapely
from shapely.geometry.base import BaseGeometry

Area = shapely.Polygon | shapely.MultiPolygon


def as_area(shape: BaseGeometry) -> Area:
    """What of a shape has an area: lines and points, which come of touching, are left out."""
    if isinstance(shape, shapely.Polygon | shapely.MultiPolygon):
        return shape
    return shapely.MultiPolygon([part for part in shapely.get_parts(shape) if isinstance(part, shapely.Polygon)])
