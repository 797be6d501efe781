"""Plan of the rest of a job from where its robot stands, round what it has seen."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from touchline.jobs.shared.shared_job import ASTRAY_M
from touchline.jobs.shared.unfinished_lines import body_at, grown
from touchline.jobs.way_round.unpainted_lines import Gap, UnpaintedLines
from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import Polygon, Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.collision.checker import MARGIN_M
from touchline.services.planner.plan import Plan, plan

Pose = tuple[float, float, float]

SPARE_M: Final = 0.005
"""Distance beyond the planner's margin that is left to a thing beside the standing robot."""


@dataclass(frozen=True)
class RoundPlan:
    """Planned rest of a job.

    Attributes:
        template: The rest: unpainted parts of lines, with what was seen as obstacles.
        options: Options of the plan, with the robot's pose as its start.
        plan: The plan.
    """

    template: Template
    options: PlanOptions
    plan: Plan


def plan_round(
    unpainted: UnpaintedLines,
    gaps: Sequence[Gap],
    pose: Pose,
    seen: Iterable[Polygon],
    options: PlanOptions,
    enough: Callable[[], bool] = lambda: False,
) -> RoundPlan:
    """Plan gaps in lines from where the robot stands, round what it has seen; note what is left out again.

    Args:
        unpainted: Unpainted lines of the job.
        gaps: The ones to paint.
        pose: x (m), y (m), heading (rad) of the standing robot, map frame.
        seen: Outlines of what it has seen.
        options: Options of the job's plan.
        enough: Returns whether to take the best order so far.

    Raises:
        PlanningError: Nothing of it can be reached.
    """
    vehicle = unpainted.vehicle
    rest = unpainted.rest(gaps)
    rest = rest.model_copy(update={"obstacles": (*rest.obstacles, *with_margin(seen, pose, vehicle))})
    here = options.model_copy(update={"start": np.array(pose), "obstructed": ""})
    planned = plan(rest, vehicle, here, enough=enough)
    unpainted.note(rest, planned.report.left_out)
    return RoundPlan(rest, here, planned)


def with_margin(seen: Iterable[Polygon], pose: Pose, vehicle: Vehicle) -> list[Polygon]:
    """Return outlines with the margin that protection keeps and the robot's distance from its path.

    One beside which the robot stands nearer than that gets as much of it as leaves the robot free to go.
    """
    import shapely

    body, found = body_at(pose, vehicle), list[Polygon]()
    for each in seen:
        shape = shapely.Polygon(each.corners)
        spare_m = float(body.distance(shape)) - MARGIN_M - SPARE_M
        found.append(grown(each.id, shape, max(min(vehicle.protection.margin_m + ASTRAY_M, spare_m), 0.0)))
    return found
