"""What is to be planned."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np

from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.limits import Limits

if TYPE_CHECKING:
    import shapely


@dataclass(frozen=True)
class Company:
    """Other robots that work on the same ground meanwhile.

    Attributes:
        painted: (n, 7) rows of `sequencing.wet_paint`: what they paint, and when.
        crossing_s: How long it may take at least to avoid one crossing of a wet line, theirs or one's own, seconds.
        grounds: By its id, what of each area this robot covers (m, map frame); of an area that is not named, nothing.
            None: all of every area.
        left: Likewise, what of that is left to be covered; None: all of it.
        begins_rad: Direction of the side with which its laps begin (rad); None: whichever suits best.
    """

    painted: Floats = field(default_factory=lambda: np.zeros((0, 7)))
    crossing_s: float = 0.0
    grounds: Mapping[str, shapely.Polygon | shapely.MultiPolygon] | None = None
    left: Mapping[str, shapely.Polygon | shapely.MultiPolygon] | None = None
    begins_rad: float | None = None


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
