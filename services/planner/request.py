"""Answers to plan requests, for the service and the command line."""

from collections.abc import Callable
from functools import lru_cache
from typing import Final

from touchline.core.stopwatch import Stopwatch
from touchline.schemas.catalogue import parse_template
from touchline.schemas.errors import NothingReachedError, PlanningError, TouchlineError
from touchline.schemas.ground_piece import RemainingPieces
from touchline.schemas.known_ground import OPEN_GROUND, KnownGround
from touchline.schemas.messages import PlanRequest, PlanResponse
from touchline.schemas.plugin_packages import blamed
from touchline.schemas.spec import parse
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.goal_plan import plan_to_goal
from touchline.services.planner.plan import Plan, plan
from touchline.services.planner.plan_task import ALONE, Company
from touchline.services.planner.tour import ordering

VEHICLES_KEPT: Final = 64
"""Size of the cache of vehicles, as a robot sends the same one with every request."""

GROUNDS_KEPT: Final = 4


def answer(
    request: PlanRequest, vehicle: Vehicle, progress: Callable[[str, float], None] = lambda stage, fraction: None
) -> PlanResponse:
    """Plan for a request; without a plan `success` is false and the message gives the reason.

    The report's planning time includes reading the template. Choices of a plan to a goal stand in the message.

    Args:
        request: Request; its vehicle, if any, takes precedence over `vehicle`.
        vehicle: Default vehicle.
        progress: Called with stage and fraction.
    """
    watch = Stopwatch()
    try:
        asked_for = vehicle_of(request.vehicle_json) if request.vehicle_json else vehicle
        planned, message = _to_goal(request, asked_for) if request.goal else _template(request, asked_for, progress)
    except TouchlineError as error:
        nothing_reached = isinstance(error, NothingReachedError)
        return PlanResponse(success=False, message=str(error), nothing_reached=nothing_reached)
    except Exception as error:
        plugin_error = blamed(error)
        if plugin_error is None:
            raise
        return PlanResponse(success=False, message=str(plugin_error))
    report = planned.report.model_copy(update={"planning_time_s": watch.elapsed_s})
    return PlanResponse(success=True, message=message, trajectory=planned.trajectory, report=report)


def _template(request: PlanRequest, vehicle: Vehicle, progress: Callable[[str, float], None]) -> tuple[Plan, str]:
    """Plan the request's template; return the plan and its message."""
    if request.leaving:
        raise PlanningError("", "has a drive to leave, but no goal", "give a goal, or no leaving")
    if request.ground_json:
        raise PlanningError(
            "", "has a known ground, but no goal", "give a goal, or boundary and obstacles in the template"
        )
    template = parse_template(request.template_json)
    company = _company(request.remaining_json, template, vehicle)
    planned = plan(template, vehicle, request.options, progress, company=company)
    report = planned.report
    message = f"{template.title or template.name}: {report.painted_segments} segments, {report.total_time_s:.0f} s"
    if report.left_out:
        message += f"; left out: {'; '.join(each.words for each in report.left_out)}"
    flipped = [section.stroke.id for section in planned.sections if section.stroke and section.stroke.flipped]
    if flipped and not ordering(request.options):
        message += f"; turned round to be drivable: {', '.join(flipped)}"
    return planned, message


def _company(remaining_json: str, template: Template, vehicle: Vehicle) -> Company:
    """Return that of a robot which covers remaining ground, given as text; "": all of every area."""
    if not remaining_json:
        return ALONE
    if not vehicle.tool.covers:
        problem = f"has remaining ground, and the tool of {vehicle.name} does not cover"
        raise PlanningError("", problem, "give what remains as lines of the template")
    pieces = parse(RemainingPieces, remaining_json, "the request's remaining ground").pieces
    for piece in pieces:
        if not piece.polygon.is_valid:
            problem = f'has a remaining piece of "{piece.area}" whose outline crosses itself'
            raise PlanningError("", problem, "give simple outlines, with holes inside")
    return Company.of_rest(template, pieces)


def _to_goal(request: PlanRequest, vehicle: Vehicle) -> tuple[Plan, str]:
    """Plan to the request's goal; return the plan and its message."""
    (goal,) = request.goal
    if request.template_json:
        raise PlanningError("", "has a goal and a template", "give one of them")
    if request.remaining_json:
        raise PlanningError("", "has a goal and remaining ground", "give one of them")
    ground = ground_of(request.ground_json) if request.ground_json else OPEN_GROUND
    leaving = next(iter(request.leaving), None)
    planned = plan_to_goal(goal, vehicle, request.options, leaving, ground, request.search)
    length_m, takes_s = planned.report.total_length_m, planned.report.total_time_s
    return planned, "; ".join((f"to the goal: {length_m:.2f} m, {takes_s:.2f} s", *planned.notes))


@lru_cache(GROUNDS_KEPT)
def ground_of(text: str) -> KnownGround:
    """Parse the known ground of a request.

    Raises:
        SpecError: It is none.
    """
    return parse(KnownGround, text, "the request's ground")


@lru_cache(VEHICLES_KEPT)
def vehicle_of(text: str) -> Vehicle:
    """Parse the vehicle of a request.

    Raises:
        SpecError: It is no vehicle.
    """
    return parse(Vehicle, text, "the request's vehicle")
