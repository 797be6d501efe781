"""Warm-up of the coordinator: compiles or loads every kernel before any robot waits for it."""

from __future__ import annotations

import math
from typing import Final

from touchline.coordination.coordination import Coordination, Reported, plan_settings_of
from touchline.coordination.dispatch.task_routes import warm_up_routes
from touchline.coordination.exchange import Exchange
from touchline.coordination.free_area import FreeArea
from touchline.coordination.plans.committed_plans import warm_up_plans
from touchline.coordination.team_status import team_status
from touchline.schemas.messages import PlanState, Whereabouts
from touchline.schemas.team import TaskSpec, TeamScenario

_SILENT_TICKS: Final = 1000
"""Ticks of silence after which a robot is at rest."""


def warm_up_team(team: TeamScenario, area: FreeArea) -> None:
    """Run exchanges of a throw-away team of two, one of which falls silent, by the team's task if possible."""
    task: TaskSpec = team.task if team.task.kind == "deploy" else TeamScenario().task
    low, high = area.hull.min(axis=0), area.hull.max(axis=0)
    x, y = area.pieces[0][: area.sizes[0]].mean(axis=0).tolist()
    off = 1e-3 * float((high - low).min())
    count = 1 if team.by_plans else 2  # two stand nearer here than plans may be
    avoid = "plans" if team.by_plans and team.avoid == "none" else team.avoid  # as their algorithm, which is not asked
    given = {"robots": count, "places": {}, "task": task, "algorithm": None, "avoid": avoid}
    pair = team.model_copy(update=given)
    coordination = Coordination(pair, area)
    exchange = Exchange(pair, coordination)
    silent = exchange.update_ticks * math.ceil(_SILENT_TICKS / exchange.update_ticks)
    for tick in (exchange.update_ticks, 2 * exchange.update_ticks, silent):
        names = pair.names[:1] if tick == silent else pair.names
        exchange.at(tick, {name: _standing(team, tick / 100.0, x + k * off, y) for k, name in enumerate(names)})
    coordination.cells()
    team_status(coordination, area)
    if team.by_plans:
        warm_up_plans(plan_settings_of(team, certain=False).limits)
    warm_up_routes()


def _standing(team: TeamScenario, stamp_s: float, x_m: float, y_m: float) -> Reported:
    """Return the message of a robot that stands at a place."""
    if team.by_plans:
        return PlanState(stamp_s=stamp_s, x_m=x_m, y_m=y_m)
    return Whereabouts(stamp_s=stamp_s, x_m=x_m, y_m=y_m, stop_x_m=x_m, stop_y_m=y_m)
