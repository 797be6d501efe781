"""Lines of a shared job that are left, and their plan."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, Self

from touchline.jobs.shared.errand import ErrandStatus
from touchline.jobs.shared.left_work import Floats, LeftWork, Progress, round_standing
from touchline.jobs.shared.remains import Standing, left_out, shortened
from touchline.jobs.shared.shared_job import SharedJob, share_job
from touchline.schemas.errors import PlanningError
from touchline.schemas.template import TemplateSegment
from touchline.services.planner.collision.clear_lines import clear_lines
from touchline.services.planner.limits import Limits

TRIES: Final = 40
"""So often the rest is planned round those that stand, each time with a little less of a line beside them."""


@dataclass(frozen=True)
class LinesLeft(LeftWork):
    """Lines and parts of lines.

    Attributes:
        segments: They.
    """

    segments: tuple[TemplateSegment, ...] = ()

    def __bool__(self) -> bool:
        """Whether there are any."""
        return bool(self.segments)

    def __str__(self) -> str:
        """Their length."""
        return f"{self.length_m:.1f} m"

    @property
    def length_m(self) -> float:
        """Of all together."""
        return sum(segment.curve().length_m for segment in self.segments)

    @property
    def figures(self) -> dict[str, Any]:
        """Their length."""
        return {"left_out_m": self.length_m}

    @property
    def names(self) -> list[str]:
        """Of the lines."""
        return [segment.id for segment in self.segments]

    def joined(self, job: SharedJob, told: Sequence[ErrandStatus]) -> Self:
        """These, and what robots have not painted, by what they believe."""
        unfinished = (segment for each in told for segment in each.errand.unfinished(each.painted))
        return type(self)((*self.segments, *unfinished))

    def planned(
        self,
        job: SharedJob,
        crew: Sequence[Standing],
        standing: Sequence[Standing],
        painted: Floats,
        progress: Progress,
    ) -> tuple[SharedJob, Self]:
        """As of any work that is left, with ever less of the lines that end beside a robot that stands there."""
        template = job.template.model_copy(update={"segments": self.segments})
        rest = round_standing(template, job.vehicle, standing)
        clear = clear_lines(rest, job.vehicle, Limits.of(job.vehicle, job.options))
        if not clear:
            raise PlanningError("", "has nothing left that can be reached", "move the robots that stand there")
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
