"""Answers of the planner to the robot's process, which asks by itself."""

from __future__ import annotations

from typing import Final

from touchline.bus import Answer
from touchline.schemas import messages as m
from touchline.schemas.cdr import decode
from touchline.schemas.errors import PayloadError

NO_PLANNER: Final = "no planner answers; is it running?"


def plan_response(answer: Answer) -> m.PlanResponse | str:
    """Return the planner's response; a text if it gave none, which says why."""
    if answer.payload is None:
        return answer.refusal or NO_PLANNER
    try:
        return decode(m.PlanResponse, answer.payload)
    except PayloadError as error:
        return str(error)
