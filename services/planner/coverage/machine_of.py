"""A vehicle as coverage methods see it."""

import math

from touchline.schemas.errors import PlanningError
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.coverage.machine import CoverageMachine
from touchline.services.planner.limits import Limits


def machine_of(vehicle: Vehicle, limits: Limits) -> CoverageMachine:
    """The machine that a vehicle is within the limits of a plan.

    Its bends are as tight as the drive allows, and as slow and as sharp as that takes.

    Raises:
        PlanningError: Its tool is not where coverage methods need it.
    """
    if vehicle.tool.point_m != (0.0, 0.0):
        x_m, y_m = vehicle.tool.point_m
        problem = f"is for {vehicle.name}, whose tool is at ({x_m:g}, {y_m:g}) m of the body"
        raise PlanningError(
            "", problem, "use the area method parallel, or a vehicle with its tool at the body's origin"
        )
    bend_mps = limits.steady_speed_mps(limits.curvature_max_1pm)
    return CoverageMachine(
        vehicle.tool.width_m,
        vehicle.body.footprint_m,
        limits.curvature_max_1pm,
        min(limits.sharpness_max_1pm2, limits.drive.sharpness_at(bend_mps)),
        limits.paint_speed_mps,
        limits.acceleration_mps2,
        vehicle.drive.can_reverse,
        limits.caps.drive.spin_lever_m() if vehicle.drive.can_spin else math.inf,
        bend_mps,
    )
