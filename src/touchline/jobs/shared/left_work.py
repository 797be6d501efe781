"""What is left of a shared job: lines that are not painted, or ground that is not covered."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from touchline.jobs.shared.errand import ErrandStatus
from touchline.jobs.shared.remains import Standing
from touchline.jobs.shared.shared_job import APART_M, ASTRAY_M, SharedJob
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle

Progress = Callable[[float, str], None]
Floats = NDArray[np.float64]


class LeftWork(ABC):
    """See the module; false where nothing is left."""

    @abstractmethod
    def __bool__(self) -> bool:
        """Whether anything is left."""

    @abstractmethod
    def __str__(self) -> str:
        """How much, for people."""

    @property
    @abstractmethod
    def figures(self) -> dict[str, Any]:
        """How much of it could not be reached, as of a report."""

    @property
    @abstractmethod
    def names(self) -> list[str]:
        """What it is, for people."""

    @abstractmethod
    def joined(self, job: SharedJob, told: Sequence[ErrandStatus]) -> Self:
        """This, and what robots have left of their errands.

        Args:
            job: Theirs.
            told: By each of them.
        """

    def with_ever_less(self) -> Iterator[Self]:
        """What of it may be planned where all of it cannot be."""
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
        """It, planned round robots that stand, and what of it cannot be reached beside them.

        Args:
            job: That is given up now.
            crew: Who does it, and where they stand.
            standing: The others.
            painted: (n, 7) rows of all lines that have been begun, at times before now.
            progress: Told the fraction done, and what is being done.

        Raises:
            PlanningError: It cannot be planned.
        """


def round_standing(template: Template, vehicle: Vehicle, standing: Sequence[Standing]) -> Template:
    """A template with robots that stand as its obstacles, each with the room that others leave round it."""
    outlines = (each.outline(vehicle, APART_M + ASTRAY_M) for each in standing)
    before = (each for each in template.obstacles if not each.id.startswith("robot "))
    return template.model_copy(update={"obstacles": (*before, *outlines)})
