"""The rest of a shared job, planned for the robots that are left, round those that stand on the field."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import combinations, islice
from typing import Final

import numpy as np

from touchline.core.arcs import LENGTH
from touchline.jobs.shared.ground_left import GroundLeft
from touchline.jobs.shared.left_work import Floats, LeftWork, Progress
from touchline.jobs.shared.lines_left import LinesLeft
from touchline.jobs.shared.remains import Standing
from touchline.jobs.shared.shared_job import SharedJob, clocked
from touchline.onboard.interface import PaintBelief
from touchline.schemas.errors import PlanningError
from touchline.schemas.template import Template
from touchline.services.planner.sequencing.wet import BEGUN, SPEED
from touchline.services.planner.sharing.wet_between import painted_rows_of

CREWS: Final = 4
"""If it cannot be planned for some number of robots, so many choices of as many are tried."""


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
        left_out: What cannot be reached beside robots that stand there.
    """

    job: SharedJob
    crew: tuple[str, ...]
    left_out: LeftWork

    def __str__(self) -> str:
        """Who does what, for people."""
        shares = zip(self.crew, self.job.shares, strict=True)
        who = "; ".join(f"{name}: {_what(share)}" for name, share in shares)
        return f"{who}; {self.left_out} cannot be reached" if self.left_out else who


def _what(share: Template) -> str:
    """That a robot does."""
    if share.areas:
        return f"{sum(area.polygon.area for area in share.areas):.0f} m²"
    return ", ".join(segment.id for segment in share.segments)


def none_left(job: SharedJob) -> LeftWork:
    """Nothing of a job."""
    return GroundLeft() if job.template.areas else LinesLeft()


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


def rest_of(job: SharedJob, left: LeftWork, mates: Sequence[Mate], painted: Floats, progress: Progress) -> Rest:
    """The rest planned for those that serve, or for as many of them as it can be; if need be as much of it as can be.

    Args:
        job: That is given up now.
        left: What is left.
        mates: All robots on the field.
        painted: (n, 7) rows of all lines that have been begun, at times before now.
        progress: Told the fraction done, and what is being done.

    Raises:
        PlanningError: It cannot be planned for any.
    """
    try:
        return _rest_of(job, left, mates, painted, progress)
    except PlanningError:
        for less in left.with_ever_less():
            with suppress(PlanningError):
                return _rest_of(job, less, mates, painted, progress)
        raise


def _rest_of(job: SharedJob, left: LeftWork, mates: Sequence[Mate], painted: Floats, progress: Progress) -> Rest:
    """As `rest_of`, of all of it."""
    serving = [mate.place for mate in mates if mate.serves]
    error = PlanningError("", "has nobody left to do it", "let a robot be in service")
    for count in range(len(serving), 0, -1):
        for crew in islice(combinations(serving, count), CREWS):
            standing = [mate.place for mate in mates if mate.place not in crew]
            try:
                planned, left_out = left.planned(job, crew, standing, painted, progress)
            except PlanningError as problem:
                error = problem
            else:
                return Rest(planned, tuple(each.name for each in crew), left_out)
    raise error
