"""Obstacles of a template with the clearance that lets the robot's protection follow a plan."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from touchline.core.placed_outline import placed
from touchline.core.robust_overlay import as_area, buffer
from touchline.schemas.messages import PlanOptions
from touchline.schemas.standing_clearance import standing_clearance_m
from touchline.schemas.template import Polygon, Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.collision.checker import MARGIN_M

if TYPE_CHECKING:
    import shapely

_LESS_M: Final = MARGIN_M + 0.01
"""Distance by which the clearance is less than that of the robot's start, so that it can leave."""


def with_standing_clearance(template: Template, vehicle: Vehicle, options: PlanOptions) -> Template:
    """Return the template with its obstacles grown by the standing clearance, as far as the robot's start is from them.

    Obstacles stay as they are without a lidar, and with `margin_m` 0, which says that they have a clearance already.
    """
    clearance_m = standing_clearance_m(vehicle) - MARGIN_M
    if clearance_m <= 0.0 or not options.margin_m or not template.obstacles:
        return template
    body = placed(vehicle.body.footprint_m, options.start.tolist()) if len(options.start) else None
    return template.model_copy(
        update={"obstacles": tuple(_grown(each, clearance_m, body) for each in template.obstacles)}
    )


def _grown(obstacle: Polygon, by_m: float, body: shapely.Polygon | None) -> Polygon:
    import shapely

    shape = shapely.Polygon(obstacle.corners)
    if body is not None:
        by_m = min(by_m, max(float(shape.distance(body)) - _LESS_M, 0.0))
    if not by_m:
        return obstacle
    room = as_area(buffer(shape, by_m, quad_segs=4))
    assert isinstance(room, shapely.Polygon), "an outline is in one piece"
    corners = shapely.get_coordinates(room.exterior)[:-1].tolist()
    return Polygon(id=obstacle.id, corners=tuple((x, y) for x, y in corners))
