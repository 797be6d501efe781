"""The job that a robot can continue after an abort or a restart, as it is published."""

from __future__ import annotations

import math

from touchline.onboard.executive.covered import Covered
from touchline.onboard.executive.painted import Painted
from touchline.onboard.interface import Checkpoint
from touchline.onboard.trajectory.trajectory import LoadedTrajectory, load_trajectory
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import Header, LoadRequest, UnfinishedJob
from touchline.schemas.spec import parse
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator

RESTARTED = "the robot was restarted"


def unfinished_before(job: LoadRequest, checkpoint: Checkpoint, vehicle: Vehicle) -> UnfinishedJob:
    """Describe a job of an earlier process.

    Args:
        job: The request by which it was loaded.
        checkpoint: Place from which it can continue.
        vehicle: The robot that does it now; if it could not drive the path, share and length are NaN.
    """
    try:
        plan = load_trajectory(job.trajectory, vehicle)
    except CommandRefused:
        done_pct = total_m = math.nan
    else:
        done_pct, total_m = _done_pct(plan, checkpoint, vehicle), plan.total_length_m
    return UnfinishedJob(
        name=parse(Template, job.template_json, "the journal").name if job.template_json.strip() else "",
        done_pct=done_pct,
        arc_length_m=checkpoint.arc_length_m,
        total_length_m=total_m,
        elapsed_s=checkpoint.elapsed_s,
        reason=RESTARTED,
    )


def unfinished_here(name: str, emulator: Emulator, header: Header) -> UnfinishedJob:
    """Describe the job, by the name of its template, that the robot has just aborted."""
    status = emulator.onboard.status
    return UnfinishedJob(
        header=header,
        name=name,
        done_pct=emulator.onboard.painted.coverage_pct,
        arc_length_m=status.arc_length_m,
        total_length_m=status.total_length_m,
        elapsed_s=status.elapsed_s,
        reason=status.reason,
    )


def _done_pct(plan: LoadedTrajectory, checkpoint: Checkpoint, vehicle: Vehicle) -> float:
    """Return the share of the work that the robot will count as done when it continues there."""
    if not vehicle.tool.paints:
        return Covered(plan).belief(checkpoint.arc_length_m).coverage_pct
    owed_m = checkpoint.owed_from_m
    painted = Painted(plan, vehicle)
    painted.restore(checkpoint.arc_length_m if owed_m is None else owed_m)
    return painted.belief().coverage_pct
