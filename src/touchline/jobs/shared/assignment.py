"""Assignment of a robot in a shared job, and its reported status."""

from dataclasses import dataclass, replace

from touchline.coordination.traffic.conflicts import TimedPath
from touchline.jobs.shared.shared_job import SharedJob
from touchline.jobs.shared.unfinished_lines import unfinished
from touchline.onboard.interface import PaintBelief
from touchline.schemas.messages import Path, Trajectory
from touchline.schemas.template import Template, TemplateSegment
from touchline.services.planner.output.message import segment_of
from touchline.services.planner.plan import Plan


@dataclass(frozen=True)
class Assignment:
    """Work assigned to a robot.

    Attributes:
        plan: Its plan.
        path: The plan as the traffic rules see it.
        share: Its share of the template.
    """

    plan: Plan
    path: TimedPath
    share: Template

    def unfinished(self, painted: PaintBelief) -> list[TemplateSegment]:
        """Return the lines not painted yet, by the robot's own paint record."""
        return unfinished(self.plan, self.share, painted)

    def driven(self, reached_m: float) -> Trajectory:
        """Return the path of its plan up to an arc length (m)."""
        begun = (each for each in self.plan.sent if each.start_m < reached_m)
        cut = (
            replace(each, curve=replace(each.curve, length_m=min(each.end_m, reached_m) - each.start_m))
            for each in begun
        )
        return Trajectory(path=Path(segments=tuple(map(segment_of, cut))))

    def next_hold_m(self, furthest_m: float) -> float:
        """Return the next arc length (m) at which it can stop outside lines; `furthest_m` if there is none."""
        ahead = self.path.holds_m[self.path.holds_m >= furthest_m + self.path.brakes_m]
        return float(ahead[0]) if len(ahead) else furthest_m


@dataclass(frozen=True)
class AssignmentStatus:
    """Status of an assignment, by the robot's estimate and reports.

    Attributes:
        assignment: The assignment.
        painted: Painted parts of its lines.
        reached_m: Arc length along its path; infinite once it is done.
    """

    assignment: Assignment
    painted: PaintBelief
    reached_m: float

    @property
    def driven(self) -> Trajectory:
        """Path up to the reached arc length."""
        return self.assignment.driven(self.reached_m)


def assignments(job: SharedJob) -> list[Assignment]:
    """Return the assignment of each robot of a job."""
    return [Assignment(*each) for each in zip(job.plans, job.paths, job.shares, strict=True)]
