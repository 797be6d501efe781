"""The figures of a shared job, as a JSON object: of all robots together, and of each."""

from collections.abc import Sequence
from typing import Any

from touchline.services.runs.reports import paint_figures, plan_figures, traversal_figures
from touchline.services.runs.sharing.shared_job import SharedJob
from touchline.services.runs.sharing.shared_simulation import TeamOutcome


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
