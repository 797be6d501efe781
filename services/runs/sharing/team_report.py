"""The figures of a shared job, as a JSON object: of all robots together, and of each."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from touchline.services.runs.reports import paint_figures, plan_figures, traversal_figures
from touchline.services.runs.sharing.joint_paint import JointPaint
from touchline.services.runs.sharing.shared_job import SharedJob
from touchline.services.runs.sharing.shared_simulation import TeamOutcome

if TYPE_CHECKING:
    from touchline.services.runs.sharing.shared_bus_run import SharedBusRun


def team_figures(job: SharedJob, outcome: TeamOutcome, names: Sequence[str]) -> dict[str, Any]:
    """What has come of a shared job.

    Args:
        job: As it was planned.
        outcome: Of it.
        names: Of the robots.
    """
    paint = outcome.paint.figures()
    judged = "" if paint["accepted"] else f"the paint is not accepted: {paint['verdict']}"
    reason = outcome.reason or judged
    return {
        "success": not reason,
        "reason": reason,
        "plan": job.figures(),
        "traversal": {
            "total_time_s": outcome.total_time_s,
            "wall_time_s": outcome.wall_time_s,
            "real_time_factor": outcome.total_time_s / outcome.wall_time_s,
            "closest_bodies_m": outcome.apart_m,
            "left_out_m": outcome.left_out_m,
        },
        "paint": paint,
        "orders": [order.figures() for order in outcome.orders],
        "robots": {name: _robot_figures(job, outcome, number) for number, name in enumerate(names)},
    }


def _robot_figures(job: SharedJob, outcome: TeamOutcome, number: int) -> dict[str, Any]:
    """Of one robot: its share alone."""
    own, *after = outcome.robots[number]
    return {
        "reason": own.reason,
        "segments": [segment.id for segment in job.shares[number].segments],
        "waited_s": outcome.waited_s[number],
        "plan": plan_figures(job.plans[number].report),
        "traversal": traversal_figures(own.report, outcome.wall_time_s),
        "paint": paint_figures(own.report),
        "taken_over": [
            {
                "segments": [segment.id for segment in each.report.segments],
                "reason": each.reason,
                "traversal": traversal_figures(each.report, outcome.wall_time_s),
                "paint": paint_figures(each.report),
            }
            for each in after
        ],
    }


def bus_figures(job: SharedJob, run: "SharedBusRun", paint: JointPaint, names: Sequence[str]) -> dict[str, Any]:
    """What has come of a shared job over the bus.

    Args:
        job: As it was planned.
        run: That has carried it out.
        paint: Of all robots.
        names: Of the robots.
    """
    judged = paint.figures()
    undone = [name for name, report in zip(names, run.reports, strict=True) if not report.success]
    reason = "" if judged["accepted"] else f"the paint is not accepted: {judged['verdict']}"
    return {
        "success": not (undone or reason),
        "reason": "; ".join(f"robot {name} was not done with its share" for name in undone) or reason,
        "plan": job.figures(),
        "traversal": {
            "total_time_s": max(report.total_time_s for report in run.reports),
            "wall_time_s": run.wall_time_s,
        },
        "paint": judged,
        "robots": {
            name: {
                "segments": [segment.id for segment in share.segments],
                "plan": plan_figures(made.report),
                "traversal": traversal_figures(report, run.wall_time_s),
                "paint": paint_figures(report),
            }
            for name, share, made, report in zip(names, job.shares, job.plans, run.reports, strict=True)
        },
    }
