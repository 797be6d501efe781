"""What is to be planned."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

import numpy as np

from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.limits import Limits


@dataclass(frozen=True)
class Company:
    """Other robots that work on the same ground meanwhile.

    Attributes:
        painted: (n, 7) rows of `sequencing.wet`: what they paint, and when.
        crossing_s: How long it may take at least to avoid one crossing of a wet line, theirs or one's own, seconds.
    """

    painted: Floats = field(default_factory=lambda: np.zeros((0, 7)))
    crossing_s: float = 0.0


ALONE: Final = Company()


@dataclass(frozen=True)
class PlanTask:
    """A template in the map frame, the vehicle that shall work on it, and how to plan.

    Attributes:
        template, vehicle, options: These.
        company: Other robots on the ground.
    """

    template: Template
    vehicle: Vehicle
    options: PlanOptions
    company: Company = ALONE

    @cached_property
    def limits(self) -> Limits:
        """Of the vehicle, as far as the options leave them; raises `PlanningError` as `Limits.of` does."""
        return Limits.of(self.vehicle, self.options)
