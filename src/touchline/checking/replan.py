"""Repetition of a recorded plan."""

from __future__ import annotations

from touchline.checking.recorded_session import GivenJob
from touchline.schemas.messages import Trajectory
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.goal_plan import plan_to_goal
from touchline.services.planner.plan import plan


def planned_again(job: GivenJob, vehicle: Vehicle) -> Trajectory | None:
    """Plan again from the recorded inputs; None if they are not recorded.

    Args:
        job: The recorded job.
        vehicle: The robot's vehicle.

    Raises:
        PlanningError: It can no longer be planned.
    """
    if job.cause is None:
        return None
    if job.cause.goal is not None:
        return plan_to_goal(job.cause.goal, vehicle, job.cause.options, ground=job.cause.ground).trajectory
    return plan(job.template, vehicle, job.cause.options).trajectory if job.template is not None else None
