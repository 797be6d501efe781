"""Figures of a shared job, as a JSON object: of all robots together, and of each."""

import math
from collections.abc import Sequence
from itertools import zip_longest
from typing import TYPE_CHECKING, Any

from touchline.jobs.shared.joint_ground import JointGround
from touchline.jobs.shared.joint_paint import JointPaint
from touchline.jobs.shared.shared_job import SharedJob
from touchline.jobs.shared.shared_simulation import TeamOutcome
from touchline.jobs.single.reports import area_report_figures, paint_figures, plan_figures, traversal_figures
from touchline.jobs.single.simulation import Outcome
from touchline.jobs.team.team_figures import hash_of
from touchline.schemas.template import Template

if TYPE_CHECKING:
    from touchline.jobs.shared.shared_bus_run import SharedBusRun


def team_figures(job: SharedJob, outcome: TeamOutcome, names: Sequence[str]) -> dict[str, Any]:
    """Return the figures of a simulated shared job.

    Args:
        job: The job as first planned.
        outcome: Its outcome.
        names: Names of the robots.
    """
    kind, done = _kind(job)
    figures = outcome.work.figures()
    reason = outcome.reason or ("" if figures["accepted"] else f"the {done} is not accepted: {figures['verdict']}")
    return {
        "success": not reason,
        "reason": reason,
        "plan": _plan_figures(job, outcome.work),
        "traversal": {
            "total_time_s": outcome.total_time_s,
            "wall_time_s": outcome.wall_time_s,
            "real_time_factor": outcome.total_time_s / outcome.wall_time_s,
            "closest_bodies_m": outcome.apart_m,
            **outcome.left_out.figures,
        },
        kind: figures,
        "orders": [order.figures() for order in outcome.orders],
        "robots": {name: _robot_figures(job, outcome, number) for number, name in enumerate(names)},
        "hash": _hashes(outcome, names),
    }


def _kind(job: SharedJob) -> tuple[str, str]:
    """Return the key of the work's figures, and the word for the work."""
    return ("area", "work") if job.template.areas else ("paint", "paint")


def _plan_figures(job: SharedJob, work: JointPaint | JointGround) -> dict[str, Any]:
    """Return the plan's figures; the coverage is that of the final plans."""
    return {**job.figures(), **({"coverage_pct": work.planned_pct} if isinstance(work, JointGround) else {})}


def _hashes(outcome: TeamOutcome, names: Sequence[str]) -> dict[str, Any]:
    """Return the hashes of each robot's sessions, several after a take-over, and of all."""
    found = {
        f"{name} ({number})" if number > 1 else name: done.report.session_hash
        for name, own in zip(names, outcome.robots, strict=True)
        for number, done in enumerate(own, start=1)
    }
    return hash_of({name: digest for name, digest in found.items() if digest})


def _robot_figures(job: SharedJob, outcome: TeamOutcome, number: int) -> dict[str, Any]:
    """Return the figures of one robot and its share."""
    own, *after = outcome.robots[number]
    return {
        "reason": own.reason,
        **_share_figures(job.shares[number]),
        "waited_s": outcome.waited_s[number],
        "plan": plan_figures(job.plans[number].report),
        "traversal": traversal_figures(own.report, outcome.wall_time_s),
        **_work_figures(own),
        "taken_over": [
            {
                **({} if each.area else {"segments": [segment.id for segment in each.report.segments]}),
                "reason": each.reason,
                "traversal": traversal_figures(each.report, outcome.wall_time_s),
                **_work_figures(each),
            }
            for each in after
        ],
    }


def _share_figures(share: Template) -> dict[str, Any]:
    """Return a robot's share: lines, or parts of areas."""
    if share.areas:
        return {"areas_m2": {area.id: area.polygon.area for area in share.areas}}
    return {"segments": [segment.id for segment in share.segments]}


def _work_figures(own: Outcome) -> dict[str, Any]:
    """Return the work that one robot has done of its share."""
    if own.area is not None:
        return {"area": area_report_figures(own.area, own.report)}
    return {"paint": paint_figures(own.report)}


def bus_figures(job: SharedJob, run: "SharedBusRun", work: JointPaint | JointGround) -> dict[str, Any]:
    """Return the figures of a shared job over the bus.

    Args:
        job: The job as first planned.
        run: The finished run.
        work: Evaluated work of all robots.
    """
    kind, done = _kind(job)
    figures = work.figures()
    lacks = (run.recording or {}).get("problem", "")
    recorded = f"the recording is not complete: {lacks}" if lacks else ""
    reason = recorded if figures["accepted"] else f"the {done} is not accepted: {figures['verdict']}"
    return {
        "success": not reason,
        "reason": reason,
        "plan": _plan_figures(job, work),
        "traversal": {
            "total_time_s": max(robot.ended_s for robot in run.robots),
            "wall_time_s": run.wall_time_s,
            "closest_bodies_m": run.gap.closest_m if math.isfinite(run.gap.closest_m) else None,
            **run.left_out.figures,
        },
        kind: figures,
        "orders": run.orders,
        "recording": run.recording,
        "robots": {
            robot.name: {
                **_share_figures(share),
                "out_of_service": robot.out,
                "plan": plan_figures(made.report),
                "tasks": [
                    {
                        **({} if area else {"segments": [segment.id for segment in report.segments]}),
                        "done": report.success,
                        "traversal": traversal_figures(report, run.wall_time_s),
                        **({"area": area_report_figures(area, report)} if area else {"paint": paint_figures(report)}),
                    }
                    for report, area in zip_longest(robot.reports, robot.areas)
                ],
            }
            for robot, share, made in zip(run.robots, job.shares, job.plans, strict=True)
        },
    }
