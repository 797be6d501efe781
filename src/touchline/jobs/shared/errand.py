"""What a robot of a shared job is to do, and what it has told of how far it is."""

from dataclasses import dataclass, replace

from touchline.fleet.traffic.conflicts import TimedPath
from touchline.jobs.shared.remains import unfinished
from touchline.jobs.shared.shared_job import SharedJob
from touchline.onboard.interface import PaintBelief
from touchline.schemas.messages import Path, Trajectory
from touchline.schemas.template import Template, TemplateSegment
from touchline.services.planner.output.message import segment_of
from touchline.services.planner.plan import Plan


@dataclass(frozen=True)
class Errand:
    """What a robot is to do.

    Attributes:
        plan, path, share: Its plan, that as the traffic rules see it, and what it paints or covers.
    """

    plan: Plan
    path: TimedPath
    share: Template

    def unfinished(self, painted: PaintBelief) -> list[TemplateSegment]:
        """The lines that are left of it, by what the robot believes to have painted."""
        return unfinished(self.plan, self.share, painted)

    def driven(self, reached_m: float) -> Trajectory:
        """The path of its plan up to an arc length (m)."""
        begun = (each for each in self.plan.sent if each.start_m < reached_m)
        cut = (
            replace(each, curve=replace(each.curve, length_m=min(each.end_m, reached_m) - each.start_m))
            for each in begun
        )
        return Trajectory(path=Path(segments=tuple(map(segment_of, cut))))

    def next_hold_m(self, furthest_m: float) -> float:
        """Where a robot that drives can stop next without stopping amid a line; here, if there is no such place."""
        ahead = self.path.holds_m[self.path.holds_m >= furthest_m + self.path.brakes_m]
        return float(ahead[0]) if len(ahead) else furthest_m


@dataclass(frozen=True)
class ErrandStatus:
    """How far a robot is with its errand, by what it believes and has told.

    Attributes:
        errand: It.
        painted: Of its lines.
        reached_m: Along its path; infinite once it is done.
    """

    errand: Errand
    painted: PaintBelief
    reached_m: float

    @property
    def driven(self) -> Trajectory:
        """The path up to there."""
        return self.errand.driven(self.reached_m)


def errands(job: SharedJob) -> list[Errand]:
    """Of each robot of a job."""
    return [Errand(*each) for each in zip(job.plans, job.paths, job.shares, strict=True)]
