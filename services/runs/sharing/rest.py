"""The rest of a shared job, planned for the robots that are left, round those that stand on the field."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.errors import PlanningError
from touchline.schemas.template import Template, TemplateSegment
from touchline.services.core.arcs import LENGTH
from touchline.services.fleet.traffic.conflicts import TimedPath
from touchline.services.onboard.interface import PaintBelief
from touchline.services.planner.limits import Limits
from touchline.services.planner.plan import Plan
from touchline.services.planner.sequencing.wet import BEGUN, SPEED
from touchline.services.planner.sharing.clear_lines import clear_lines
from touchline.services.planner.sharing.wet_between import painted_rows_of
from touchline.services.runs.sharing.remains import Standing, left_out, shortened, unfinished
from touchline.services.runs.sharing.shared_job import APART_M, ASTRAY_M, SharedJob, clocked, share_job

TRIES: Final = 40
"""So often the rest is planned round those that stand, each time with a little less of a line beside them."""

Progress = Callable[[float, str], None]
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Errand:
    """What a robot is to do.

    Attributes:
        plan, path, share: Its plan, that as the traffic rules see it, and what it paints.
    """

    plan: Plan
    path: TimedPath
    share: Template

    def unfinished(self, painted: PaintBelief) -> list[TemplateSegment]:
        """What is left of it, by what the robot believes to have painted."""
        return unfinished(self.plan, self.share, painted)

    def next_hold_m(self, furthest_m: float) -> float:
        """Where a robot that drives can stop next without stopping amid a line; here, if there is no such place."""
        ahead = self.path.holds_m[self.path.holds_m >= furthest_m + self.path.brakes_m]
        return float(ahead[0]) if len(ahead) else furthest_m


def errands(job: SharedJob) -> list[Errand]:
    """Of each robot of a job."""
    return [Errand(*each) for each in zip(job.plans, job.paths, job.shares, strict=True)]


@dataclass(frozen=True)
class Mate:
    """A robot on the field.

    Attributes:
        place: Its name, and where it is.
        serves: Whether it can do some of the rest; who cannot is in the way.
    """

    place: Standing
    serves: bool


@dataclass(frozen=True)
class Rest:
    """The rest, planned.

    Attributes:
        job: What is done now.
        crew: The names of who does it, in the job's order.
        left_out: Parts of lines that cannot be reached beside robots that stand there.
    """

    job: SharedJob
    crew: tuple[str, ...]
    left_out: list[TemplateSegment]

    def __str__(self) -> str:
        """Who does what, for people."""
        who = "; ".join(
            f"{name}: {', '.join(segment.id for segment in share.segments)}"
            for name, share in zip(self.crew, self.job.shares, strict=True)
        )
        left_m = length_m(self.left_out)
        return f"{who}{f'; {left_m:.1f} m cannot be reached' if left_m else ''}"


def length_m(segments: Sequence[TemplateSegment]) -> float:
    """Of all together."""
    return sum(segment.curve().length_m for segment in segments)


def painted_before(job: SharedJob, beliefs: Sequence[PaintBelief], former: Floats, since_s: float) -> Floats:
    """(n, 7) rows of all lines that have been begun, at times before now.

    Args:
        job: That is given up now.
        beliefs: What each of its robots believes to have painted.
        former: (k, 7) rows of what was painted before the job, at times before its beginning.
        since_s: The job began so long ago.
    """
    earlier = former.copy()
    earlier[:, BEGUN] -= since_s
    rows = [earlier]
    for belief, work in zip(beliefs, clocked(job), strict=True):
        begun = {name for name, done in zip(*belief[:2], strict=True) if done > 0.0}
        own = painted_rows_of(work)[[line.id in begun for line in work.plan.sent if line.stroke]]
        own[:, BEGUN] = np.minimum(own[:, BEGUN] - since_s, -own[:, LENGTH] / own[:, SPEED])
        rows.append(own)
    return np.concatenate(rows)


def rest_of(
    job: SharedJob, left: Sequence[TemplateSegment], mates: Sequence[Mate], painted: Floats, progress: Progress
) -> Rest:
    """The rest planned for those that serve, or as many of them as it can be shared among.

    Args:
        job: That is given up now.
        left: The lines that are left.
        mates: All robots on the field.
        painted: (n, 7) rows of all lines that have been begun, at times before now.
        progress: Told the fraction done, and what is being done.

    Raises:
        PlanningError: It cannot be planned for any.
    """
    template = job.template.model_copy(update={"segments": tuple(left)})
    serving = [mate.place for mate in mates if mate.serves]
    error = PlanningError("", "has nobody left to do it", "let a robot be in service")
    for count in range(len(serving), 0, -1):
        crew = serving[:count]
        standing = [mate.place for mate in mates if mate.place not in crew]
        try:
            planned = _planned(job, template, crew, standing, painted, progress)
        except PlanningError as problem:
            error = problem
        else:
            return Rest(planned, tuple(each.name for each in crew), left_out(template, planned.template))
    raise error


def _planned(
    job: SharedJob,
    template: Template,
    crew: Sequence[Standing],
    standing: Sequence[Standing],
    painted: Floats,
    progress: Progress,
) -> SharedJob:
    """The rest planned round robots that stand, without what cannot be reached beside them."""
    outlines = tuple(each.outline(job.vehicle, APART_M + ASTRAY_M) for each in standing)
    before = tuple(each for each in template.obstacles if not each.id.startswith("robot "))
    rest = template.model_copy(update={"obstacles": (*before, *outlines)})
    clear = clear_lines(rest, job.vehicle, Limits.of(job.vehicle, job.options))
    if not clear:
        raise PlanningError("", "has nothing left that can be reached", "move the robots that stand there")
    rest = rest.model_copy(update={"segments": clear})
    for _ in range(TRIES):
        try:
            return share_job(rest, job.options, job.vehicle, [each.pose for each in crew], progress, painted)
        except PlanningError as problem:
            shorter = shortened(rest, problem, standing)
            if shorter is None:
                raise
            rest = shorter
    raise PlanningError("", f"cannot be planned in {TRIES} tries", "move the robots that stand there")
