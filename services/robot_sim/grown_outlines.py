"""Outlines of bodies and things in the map frame, with a clearance all round."""

from __future__ import annotations

from typing import TYPE_CHECKING

from touchline.core.placed_outline import placed
from touchline.core.robust_overlay import buffer
from touchline.schemas.template import Polygon
from touchline.schemas.vehicles import Vehicle

if TYPE_CHECKING:
    import shapely


def body_at(pose: tuple[float, float, float], vehicle: Vehicle) -> shapely.Polygon:
    """Return the outline of a vehicle's body at a pose, x (m), y (m), heading (rad), map frame."""
    return placed(vehicle.body.footprint_m, pose)


def grown(name: str, shape: shapely.Polygon, by_m: float) -> Polygon:
    """Return an outline with a clearance (m) all round."""
    import shapely

    room = shapely.simplify(buffer(shape, by_m, quad_segs=4), 0.01)
    corners = shapely.get_coordinates(room)[:-1].tolist()
    return Polygon(id=name, corners=tuple((a, b) for a, b in corners))
