"""A vehicle as coverage methods see it."""

from touchline.schemas.errors import PlanningError
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.coverage.machine import CoverageMachine
from touchline.services.planner.limits import Limits


def machine_of(vehicle: Vehicle, limits: Limits) -> CoverageMachine:
    """The machine that a vehicle is within the limits of a plan.

    Raises:
        PlanningError: Its tool is not where coverage methods need it.
    """
    if vehicle.tool.point_m != (0.0, 0.0):
        x_m, y_m = vehicle.tool.point_m
        problem = f"is for {vehicle.name}, whose tool is at ({x_m:g}, {y_m:g}) m of the body"
        raise PlanningError(
            "", problem, "use the area method parallel, or a vehicle with its tool at the body's origin"
        )
    return CoverageMachine(
        vehicle.tool.width_m,
        vehicle.body.footprint_m,
        limits.curvature_max_1pm,
        min(limits.sharpness_max_1pm2, limits.drive.sharpness_at(limits.paint_speed_mps)),
        limits.paint_speed_mps,
        limits.acceleration_mps2,
        vehicle.drive.can_reverse,
    )
