"""Remaining lines of a shared job, and their plan."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, Self

from touchline.core.plain_sum import plain_sum
from touchline.jobs.shared.assignment import AssignmentStatus
from touchline.jobs.shared.remaining_work import Floats, Progress, RemainingWork, round_standing
from touchline.jobs.shared.shared_job import SharedJob, share_job
from touchline.jobs.shared.unfinished_lines import Standing, left_out, shortened
from touchline.schemas.errors import PlanningError
from touchline.schemas.template import TemplateSegment
from touchline.services.planner.collision.clear_lines import clear_lines
from touchline.services.planner.limits import Limits

TRIES: Final = 40
"""Attempts to plan round standing robots, each with a little less of a line beside them."""


@dataclass(frozen=True)
class RemainingLines(RemainingWork):
    """Lines and parts of lines.

    Attributes:
        segments: The remaining lines.
    """

    segments: tuple[TemplateSegment, ...] = ()

    def __bool__(self) -> bool:
        """True if any line remains."""
        return bool(self.segments)

    def __str__(self) -> str:
        """Return the length as text."""
        return f"{self.length_m:.1f} m"

    @property
    def length_m(self) -> float:
        """Total length, m."""
        return plain_sum(segment.curve().length_m for segment in self.segments)

    @property
    def figures(self) -> dict[str, Any]:
        """Length as a figure of a report."""
        return {"left_out_m": self.length_m}

    @property
    def names(self) -> list[str]:
        """Ids of the lines."""
        return [segment.id for segment in self.segments]

    def joined(self, job: SharedJob, statuses: Sequence[AssignmentStatus]) -> Self:
        """Add the lines that robots have not painted, by their own paint records.

        Args:
            job: The job of the robots.
            statuses: Status of each of their assignments.
        """
        unfinished = (segment for each in statuses for segment in each.assignment.unfinished(each.painted))
        return type(self)((*self.segments, *unfinished))

    def planned(
        self,
        job: SharedJob,
        crew: Sequence[Standing],
        standing: Sequence[Standing],
        painted: Floats,
        progress: Progress,
    ) -> tuple[SharedJob, Self]:
        """See `RemainingWork.planned`; lines that end beside a standing robot are shortened until a plan is found."""
        template = job.template.model_copy(update={"segments": self.segments})
        rest = round_standing(template, job.vehicle, standing)
        clear = clear_lines(rest, job.vehicle, Limits.of(job.vehicle, job.options))
        if not clear:
            raise PlanningError("", "has no remaining work within reach", "move the robots that stand there")
        rest = rest.model_copy(update={"segments": clear})
        for _ in range(TRIES):
            try:
                made = share_job(rest, job.options, job.vehicle, [each.pose for each in crew], progress, painted)
            except PlanningError as problem:
                shorter = shortened(rest, problem, standing)
                if shorter is None:
                    raise
                rest = shorter
            else:
                return made, type(self)(tuple(left_out(template, made.template)))
        raise PlanningError("", f"cannot be planned in {TRIES} tries", "move the robots that stand there")
