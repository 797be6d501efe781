"""Repetition of a recorded plan."""

from __future__ import annotations

from touchline.checking.recorded_session import GivenJob
from touchline.schemas.messages import Trajectory
from touchline.schemas.template import Polygon
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.calibration_drive import plan_calibration
from touchline.services.planner.goal_plan import plan_to_goal
from touchline.services.planner.plan import plan
from touchline.services.planner.plan_task import Company


def planned_again(job: GivenJob, vehicle: Vehicle) -> Trajectory | None:
    """Plan again from the recorded inputs; None if they are not recorded.

    Args:
        job: The recorded job.
        vehicle: The robot's vehicle.

    Raises:
        PlanningError: It can no longer be planned.
    """
    if job.cause is None or not job.is_plannable:
        return None
    if job.cause.goal is not None:
        options, ground, search = job.cause.options, job.cause.ground, job.cause.search
        return plan_to_goal(job.cause.goal, vehicle, options, job.leaving, ground, search).trajectory
    if job.cause.calibration:
        return plan_calibration(vehicle, job.cause.options.start.tolist(), job.cause.ground).plan.trajectory
    assert job.template is not None, "it is plannable"
    seen = tuple(Polygon(id=each.id, corners=each.corners) for each in job.cause.ground.obstacles)
    template = job.template.model_copy(update={"obstacles": (*job.template.obstacles, *seen)})
    company = Company.of_rest(template, job.cause.remaining)
    return plan(template, vehicle, job.cause.options, company=company).trajectory
