"""Evaluation of the work of several robots together: paint, or covered ground."""

from collections.abc import Sequence

from touchline.jobs.shared.joint_ground import JointGround, joint_ground
from touchline.jobs.shared.joint_paint import JointPaint, Work, joint_paint
from touchline.jobs.shared.shared_job import SharedJob
from touchline.schemas.messages import Trajectory


def evaluate_work(job: SharedJob, planned: Sequence[Trajectory], works: Sequence[Work]) -> JointPaint | JointGround:
    """Evaluate the work of a job; takes a moment.

    Args:
        job: The job as first planned.
        planned: Planned trajectories of all robots: aborted ones as far as they were driven, and their replacements.
        works: Work of all robots, on one clock.
    """
    if not job.template.areas:
        return joint_paint(job.template, job.vehicle, works)
    return joint_ground(job.template, job.vehicle, planned, works)
