"""The work of several robots, judged together: paint, or ground that was covered."""

from collections.abc import Sequence

from touchline.jobs.shared.joint_ground import JointGround, joint_ground
from touchline.jobs.shared.joint_paint import JointPaint, Work, joint_paint
from touchline.jobs.shared.shared_job import SharedJob
from touchline.schemas.messages import Trajectory


def judged(job: SharedJob, planned: Sequence[Trajectory], works: Sequence[Work]) -> JointPaint | JointGround:
    """What has come of a job; takes a moment.

    Args:
        job: As it was planned at first.
        planned: What all robots were to drive: what was given up as far as it was driven, and what came instead.
        works: Of all robots, on one clock.
    """
    if not job.template.areas:
        return joint_paint(job.template, job.vehicle, works)
    return joint_ground(job.template, job.vehicle, planned, works)
