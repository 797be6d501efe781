"""The figures of a team's run."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from touchline.services.fleet.lloyd import EVEN, deployment, settled, square_cost
from touchline.services.fleet.tasks import Deploy, GoalLists
from touchline.services.runs.team.team_run import TeamRun

NEAR_END: Final = 1.05
"""A team counts as spread once H stays within 5 % of what it is in the end."""


def team_figures(run: TeamRun, wall_time_s: float) -> dict[str, Any]:
    """All of them, as JSON; SI units.

    Args:
        run: That has ended.
        wall_time_s: How long it took.
    """
    trace, contacts, sim_s = run.trace, run.contacts, run.ticks / 100.0
    task = {"deploy": _deployed(run)} if isinstance(run.task, Deploy) else {}
    if isinstance(run.task, GoalLists):
        task["goals"] = {"arrived": int(run.arrived.sum()), "all_arrived_s": _number(trace.arrived_s)}
    stopped = _stopped(run)
    return {
        "success": not _why_not(run),
        "reason": _why_not(run),
        "team": run.team.name,
        "robots": len(run.names),
        "vehicle": run.team.vehicle.name,
        "task": run.team.task.kind,
        "avoid": run.team.avoid,
        "seed": run.team.world.seed,
        "time_s": sim_s,
        "contacts": contacts.count,
        "closest_m": _number(contacts.closest_m),
        "bodies_apart_m": _number(contacts.closest_m - 2.0 * run.body_radius_m),
        "beyond_walls_robot_s": trace.beyond_walls_s,
        "driven_mean_m": float(trace.driven_m.mean()),
        "driven_max_m": float(trace.driven_m.max()),
        **task,
        "believed": {
            "nearest_segments_m": _number(run.guide.believed.nearest_segments_m),
            "outside_cell_max_m": _number(run.guide.believed.outside_cell_m),
        },
        "stopped": stopped,
        "real_time_factor": sim_s / wall_time_s,
        "wall_time_s": wall_time_s,
        "hash": {"session": run.session_hash, "robots": run.hashes},
    }


def _deployed(run: TeamRun) -> dict[str, Any]:
    """How well a team is spread, and how fast."""
    cost = np.array(run.trace.cost)
    late = np.flatnonzero(cost > NEAR_END * cost[-1])
    spread_s = run.trace.times_s[min(int(late[-1]) + 1, len(cost) - 1)] if len(late) else 0.0
    start = np.array([(run.starts[name].x_m, run.starts[name].y_m) for name in run.names])
    of_squares = None
    if run.density == EVEN:
        of_squares = float(cost[-1] / square_cost(len(run.names), run.area.area_m2))
    of_points = None
    if not len(run.area.walls):
        points = settled(start, run.area, run.density)
        of_points = float(cost[-1] / deployment(points, run.area, run.density).cost)
    return {
        "cost_m4": float(cost[-1]),
        "of_squares": of_squares,
        "of_points": of_points,
        "spread_s": spread_s,
    }


def _stopped(run: TeamRun) -> dict[str, str]:
    """Who does not drive any more, and why, by name."""
    found = {name: robot.emulator.onboard.status for name, robot in run.robots.items()}
    return {name: status.reason for name, status in found.items() if status.reason}


def _why_not(run: TeamRun) -> str:
    if run.team.avoid == "cells" and run.contacts.count:
        return f"{run.contacts.count} contacts"
    if run.team.avoid == "cells" and (stopped := _stopped(run)):
        name, reason = next(iter(stopped.items()))
        return f"{len(stopped)} robots have stopped; {name}: {reason}"
    if isinstance(run.task, GoalLists) and run.team.avoid == "cells" and not run.arrived.all():
        missing = [name for name, there in zip(run.names, run.arrived, strict=True) if not there]
        return f"{len(missing)} robots have not arrived: {', '.join(missing[:5])}"
    return ""


def _number(value: float) -> float | None:
    """A number that JSON can hold."""
    return value if math.isfinite(value) else None
