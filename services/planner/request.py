"""Answers plan requests, for the service and for the command line."""

import time
from collections.abc import Callable
from functools import lru_cache
from typing import Final

from touchline.schemas.catalogue import parse_template
from touchline.schemas.errors import TouchlineError
from touchline.schemas.messages import PlanRequest, PlanResponse
from touchline.schemas.spec import parse
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import plan
from touchline.services.planner.tour import ordering

VEHICLES_KEPT: Final = 64
"""A robot sends the same vehicle with every request."""


def answer(
    request: PlanRequest, vehicle: Vehicle, progress: Callable[[str, float], None] = lambda stage, fraction: None
) -> PlanResponse:
    """The plan for a request, or `success` false and the reason, naming the segment, why there is none.

    The report's planning time includes reading the template.

    Args:
        request: What to plan; its vehicle, if it has one, goes before `vehicle`.
        vehicle: The planner's own.
        progress: Told stage and fraction.
    """
    begun = time.perf_counter()
    try:
        asked_for = vehicle_of(request.vehicle_json) if request.vehicle_json else vehicle
        template = parse_template(request.template_json)
        planned = plan(template, asked_for, request.options, progress)
    except TouchlineError as error:
        return PlanResponse(success=False, message=str(error))
    report = planned.report.model_copy(update={"planning_time_s": time.perf_counter() - begun})
    message = f"{template.title or template.name}: {report.painted_segments} segments, {report.total_time_s:.0f} s"
    flipped = [section.stroke.id for section in planned.sections if section.stroke and section.stroke.flipped]
    if flipped and not ordering(request.options):
        message += f"; turned round to be drivable: {', '.join(flipped)}"
    return PlanResponse(success=True, message=message, trajectory=planned.trajectory, report=report)


@lru_cache(VEHICLES_KEPT)
def vehicle_of(text: str) -> Vehicle:
    """The vehicle of a request.

    Raises:
        SpecError: It is none; it names the field.
    """
    return parse(Vehicle, text, "the request's vehicle")
