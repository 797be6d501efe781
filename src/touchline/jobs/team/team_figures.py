"""Figures of a team's run."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from touchline.coordination.algorithms.wish_figures import why_held, wish_figures
from touchline.coordination.dispatch.dispatch_figures import dispatch_figures, why_not_dispatched
from touchline.coordination.dispatch.dispatched_task import dispatched
from touchline.coordination.lloyd import EVEN, deployment, settled, square_cost
from touchline.jobs.team.team_run import TeamRun

NEAR_END: Final = 1.05
"""A team counts as spread once H stays within 5 % of its final value."""


def team_figures(run: TeamRun, wall_time_s: float) -> dict[str, Any]:
    """Return all figures as a JSON object; SI units.

    Args:
        run: The finished run.
        wall_time_s: Its wall-clock duration.
    """
    trace, contacts, sim_s = run.trace, run.contacts, run.ticks / 100.0
    task = {} if run.task.ends_on_arrival else {"deploy": _deployed(run)}
    if (tasks := dispatched(run.task)) is not None:
        tasks.dispatcher.close("the run has ended")
        task["dispatch"] = dispatch_figures(tasks.dispatcher.queue())
    elif run.task.ends_on_arrival:
        task["goals"] = {
            "arrived": int(run.arrived.sum()),
            "all_arrived_s": trace.ended_s if run.arrived.all() else None,
            "hindrances": run.blockages(),
        }
    stopped, wishes = _stopped(run), wish_figures(run.task, run.guide.interventions)
    problem = why_held(wishes) or _why_not(run)
    return {
        "success": not problem,
        "reason": problem,
        "team": run.team.name,
        "robots": len(run.names),
        "vehicle": run.team.vehicle.name,
        "task": run.team.task.kind,
        "avoid": run.team.avoid,
        "seed": run.team.world.seed,
        "time_s": sim_s,
        "contacts": len(contacts.pairs) + len(contacts.at_walls),
        "contacts_with_walls": len(contacts.at_walls),
        "contacts_of_obedient": len(_between_obedient(run)),
        "closest_m": _number(contacts.closest_m),
        "bodies_apart_m": _number(contacts.closest_m - 2.0 * run.body_radius_m),
        "beyond_walls_robot_s": trace.beyond_walls_s,
        "driven_mean_m": float(trace.driven_m.mean()),
        "driven_max_m": float(trace.driven_m.max()),
        **task,
        "believed": _believed(run),
        **wishes,
        "stopped": stopped,
        "real_time_factor": sim_s / wall_time_s,
        "wall_time_s": wall_time_s,
        "hash": hash_of(run.hashes),
    }


def _deployed(run: TeamRun) -> dict[str, Any]:
    """Return how well a team is spread, and how fast."""
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


def _believed(run: TeamRun) -> dict[str, float | None]:
    """Return how far robots were apart by their own estimates."""
    believed = run.guide.believed
    nearest, outside = ("plans", "off_plan") if run.team.by_plans else ("segments", "outside_cell")
    return {f"nearest_{nearest}_m": _number(believed.nearest_m), f"{outside}_max_m": _number(believed.outside_m)}


def _stopped(run: TeamRun) -> dict[str, str]:
    """Return robots that have stopped, with the reason, by name."""
    found = {name: robot.stopped for name, robot in run.robots.items()}
    return {name: reason for name, reason in found.items() if reason}


def _between_obedient(run: TeamRun) -> list[tuple[str, str]]:
    """Return contacts of two robots whose wheels followed their commands."""
    named = [(run.names[one], run.names[other]) for one, other in run.contacts.pairs]
    return [pair for pair in named if not run.disobedient.intersection(pair)]


def _why_not(run: TeamRun) -> str:
    """Return why a run has failed: a contact, a healthy robot that stopped, or one that did not arrive."""
    if run.team.avoid == "none":
        return ""
    if touched := _between_obedient(run):
        return f"{len(touched)} contacts, first of {touched[0][0]} and {touched[0][1]}"
    if walls := [run.names[k] for k in run.contacts.at_walls if run.names[k] not in run.disobedient]:
        return f"{len(walls)} contacts with walls, first of {walls[0]}"
    if run.guide.problem and not run.disobedient:
        return run.guide.problem
    faulty = {*run.team.faults, *run.team.frozen}
    for name, reason in _stopped(run).items():
        if name not in faulty and not run.guide.problem:
            return f"{name} has stopped: {reason}"
    if (tasks := dispatched(run.task)) is not None:
        return "" if faulty else why_not_dispatched(tasks.dispatcher.queue())
    if run.task.ends_on_arrival:
        lost = [name for name, reason in run.blockages().items() if not (faulty and reason)]
        if lost:
            return f"{len(lost)} robots have not arrived: {', '.join(lost[:5])}"
    return ""


def hash_of(robots: Mapping[str, str]) -> dict[str, Any]:
    """Return the sessions' hashes, by name, and one of them all, independent of the order of robots."""
    lines = "".join(f"{name} {digest}\n" for name, digest in sorted(robots.items()))
    return {"session": hashlib.sha256(lines.encode()).hexdigest()[:16] if lines else "", "robots": dict(robots)}


def _number(value: float) -> float | None:
    """Return a number that JSON can hold."""
    return value if math.isfinite(value) else None
