"""Plan of the rest of a shared job, for the remaining robots, round those that stand on the field."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import combinations, islice
from typing import Final

import numpy as np

from touchline.core.arcs import LENGTH
from touchline.jobs.shared.remaining_ground import RemainingGround
from touchline.jobs.shared.remaining_lines import RemainingLines
from touchline.jobs.shared.remaining_work import Floats, Progress, RemainingWork
from touchline.jobs.shared.shared_job import SharedJob, clocked
from touchline.jobs.shared.unfinished_lines import Standing
from touchline.onboard.interface import PaintBelief
from touchline.schemas.errors import PlanningError
from touchline.schemas.template import Template
from touchline.services.planner.sequencing.wet_paint import BEGUN, SPEED
from touchline.services.planner.sharing.wet_between import painted_rows_of

CREWS: Final = 4
"""Choices of robots tried for each number of robots."""


@dataclass(frozen=True)
class FieldRobot:
    """A robot on the field.

    Attributes:
        place: Its name and pose.
        serves: True if it can do some of the rest; otherwise it is an obstacle.
    """

    place: Standing
    serves: bool


@dataclass(frozen=True)
class ReplannedRest:
    """Planned rest of a job.

    Attributes:
        job: The job from now on.
        crew: Names of the working robots, in the job's order.
        left_out: Work that cannot be reached beside standing robots.
    """

    job: SharedJob
    crew: tuple[str, ...]
    left_out: RemainingWork

    def __str__(self) -> str:
        """Return the shares as text."""
        shares = zip(self.crew, self.job.shares, strict=True)
        who = "; ".join(f"{name}: {_what(share)}" for name, share in shares)
        return f"{who}; {self.left_out} cannot be reached" if self.left_out else who


def _what(share: Template) -> str:
    """Return the share of a robot as text."""
    if share.areas:
        return f"{sum(area.polygon.area for area in share.areas):.0f} m²"
    return ", ".join(segment.id for segment in share.segments)


def no_remaining_work(job: SharedJob) -> RemainingWork:
    """Return an empty rest of a job."""
    return RemainingGround() if job.template.areas else RemainingLines()


def painted_before(job: SharedJob, beliefs: Sequence[PaintBelief], former: Floats, since_s: float) -> Floats:
    """Return (n, 7) rows of all lines that have been begun, at times before now.

    Args:
        job: The job that ends now.
        beliefs: Estimated paint of each of its robots.
        former: (k, 7) rows painted before the job, at times before its beginning.
        since_s: Time since the job began.
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


def replan_rest(
    job: SharedJob, remaining: RemainingWork, robots: Sequence[FieldRobot], painted: Floats, progress: Progress
) -> ReplannedRest:
    """Plan the rest for all serving robots, else for as many as possible; if need be only a part of it.

    Args:
        job: The job that ends now.
        remaining: Its remaining work.
        robots: All robots on the field.
        painted: (n, 7) rows of all lines that have been begun, at times before now.
        progress: Called with the fraction done and the present stage.

    Raises:
        PlanningError: It cannot be planned for any robot.
    """
    try:
        return _rest_of(job, remaining, robots, painted, progress)
    except PlanningError:
        for less in remaining.with_ever_less():
            with suppress(PlanningError):
                return _rest_of(job, less, robots, painted, progress)
        raise


def _rest_of(
    job: SharedJob, remaining: RemainingWork, robots: Sequence[FieldRobot], painted: Floats, progress: Progress
) -> ReplannedRest:
    """Plan all of the rest, as `replan_rest`."""
    serving = [robot.place for robot in robots if robot.serves]
    error = PlanningError("", "has no robot that can do it", "let a robot be in service")
    for count in range(len(serving), 0, -1):
        for crew in islice(combinations(serving, count), CREWS):
            standing = [robot.place for robot in robots if robot.place not in crew]
            try:
                planned, left_out = remaining.planned(job, crew, standing, painted, progress)
            except PlanningError as problem:
                error = problem
            else:
                return ReplannedRest(planned, tuple(each.name for each in crew), left_out)
    raise error
