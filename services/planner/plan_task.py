"""What is to be planned."""

from dataclasses import dataclass
from functools import cached_property

from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.limits import Limits


@dataclass(frozen=True)
class PlanTask:
    """A template in the map frame, the vehicle that shall work on it, and how to plan."""

    template: Template
    vehicle: Vehicle
    options: PlanOptions

    @cached_property
    def limits(self) -> Limits:
        """Of the vehicle, as far as the options leave them; raises `PlanningError` as `Limits.of` does."""
        return Limits.of(self.vehicle, self.options)
