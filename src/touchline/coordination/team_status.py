"""Status of a team, as its coordinator believes."""

from __future__ import annotations

import math
from collections.abc import Mapping

from touchline.coordination.coordination import Coordination
from touchline.coordination.free_area import FreeArea
from touchline.coordination.guidance_messages import header_at
from touchline.coordination.lloyd import EVEN, square_cost
from touchline.schemas.messages import TeamCells, TeamStatus


def team_messages(
    coordination: Coordination, area: FreeArea, tick: int, known: Mapping[str, str | int]
) -> tuple[TeamCells, TeamStatus]:
    """Return the messages about a team after an update.

    Args:
        coordination: The team's coordinator.
        area: The area.
        tick: Tick of the update.
        known: Fields of the status that coordination does not know.
    """
    head = header_at(tick)
    status = team_status(coordination, area).model_copy(update={"header": head, **known})
    return TeamCells(header=head, cells=tuple(coordination.cells())), status


def team_status(coordination: Coordination, area: FreeArea) -> TeamStatus:
    """Return the status of a team, without fields that coordination does not know.

    Args:
        coordination: The team's coordinator.
        area: The area.
    """
    hub, task = coordination.hub, coordination.task
    if hub is None or task is None:
        waits = coordination.waits_for
        return TeamStatus(problem=f"waiting for {', '.join(waits[:5])}{' …' * (len(waits) > 5)}" if waits else "")
    places, outside_m = hub.places, max(hub.outside_m.values(), default=-math.inf)
    cost = math.nan
    if task.coverage is not None and task.density == EVEN:
        cost = task.coverage.deployment(places).cost / square_cost(len(places), area.area_m2)
    return TeamStatus(
        arrived=len(coordination.arrived()),
        stuck=len(hub.stuck),
        resting=len(hub.resting),
        cost_of_squares=cost,
        nearest_m=hub.nearest_m,
        outside_m=outside_m,
    )
