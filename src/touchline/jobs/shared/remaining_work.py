"""Remaining work of a shared job: lines to paint, or ground to cover."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from touchline.jobs.shared.assignment import AssignmentStatus
from touchline.jobs.shared.shared_job import APART_M, ASTRAY_M, SharedJob
from touchline.jobs.shared.unfinished_lines import Standing
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle

Progress = Callable[[float, str], None]
Floats = NDArray[np.float64]


class RemainingWork(ABC):
    """Remaining lines or ground; false where nothing remains."""

    @abstractmethod
    def __bool__(self) -> bool:
        """True if any work remains."""

    @abstractmethod
    def __str__(self) -> str:
        """Return the amount as text."""

    @property
    @abstractmethod
    def figures(self) -> dict[str, Any]:
        """Amount that could not be reached, as a report's figure."""

    @property
    @abstractmethod
    def names(self) -> list[str]:
        """Names or amounts of its parts, as text."""

    @abstractmethod
    def joined(self, job: SharedJob, statuses: Sequence[AssignmentStatus]) -> Self:
        """Add the unfinished parts of robots' assignments.

        Args:
            job: The job of the robots.
            statuses: Status of each of them.
        """

    def with_ever_less(self) -> Iterator[Self]:
        """Yield smaller and smaller parts of it, to be planned if the whole cannot be."""
        return iter(())

    @abstractmethod
    def planned(
        self,
        job: SharedJob,
        crew: Sequence[Standing],
        standing: Sequence[Standing],
        painted: Floats,
        progress: Progress,
    ) -> tuple[SharedJob, Self]:
        """Plan it round standing robots; return the job, and the part that cannot be reached beside them.

        Args:
            job: The job that ends now.
            crew: The robots that work, and where they stand.
            standing: The other robots.
            painted: (n, 7) rows of all lines that have been begun, at times before now.
            progress: Called with the fraction done and the present stage.

        Raises:
            PlanningError: It cannot be planned.
        """


def round_standing(template: Template, vehicle: Vehicle, standing: Sequence[Standing]) -> Template:
    """Return a template with standing robots as obstacles, each with the clearance that others keep.

    Args:
        template: The template to plan.
        vehicle: Vehicle of every robot.
        standing: The standing robots.
    """
    outlines = (each.outline(vehicle, APART_M + ASTRAY_M) for each in standing)
    before = (each for each in template.obstacles if not each.id.startswith("robot "))
    return template.model_copy(update={"obstacles": (*before, *outlines)})
