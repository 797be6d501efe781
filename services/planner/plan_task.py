"""Task of the planner: template, vehicle, options, and other robots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np

from touchline.schemas.errors import PlanningError
from touchline.schemas.ground_piece import GroundPiece
from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.geometry.clothoid import Floats
from touchline.services.planner.limits import Limits

if TYPE_CHECKING:
    import shapely


@dataclass(frozen=True)
class Company:
    """Other robots that work on the same ground at the same time.

    Attributes:
        painted: (n, 7) rows of `sequencing.wet_paint`: lines that they paint, with times.
        crossing_s: Minimum price of a crossing of a wet line of any robot (s).
        grounds: By area id, the part that this robot covers (m, map frame), nothing of areas that are not named; None:
            all areas.
        remaining: By area id, the rest of that ground still to be covered; None: all of it.
        begins_rad: Direction of the side with which its laps begin (rad); None: the best one.
    """

    painted: Floats = field(default_factory=lambda: np.zeros((0, 7)))
    crossing_s: float = 0.0
    grounds: Mapping[str, shapely.Polygon | shapely.MultiPolygon] | None = None
    remaining: Mapping[str, shapely.Polygon | shapely.MultiPolygon] | None = None
    begins_rad: float | None = None

    @classmethod
    def of_rest(cls, template: Template, pieces: Sequence[GroundPiece]) -> Company:
        """Return that of a robot which covers the remaining pieces of a template's areas; without pieces, all of them.

        Raises:
            PlanningError: A piece is of no area of the template.
        """
        import shapely

        if not pieces:
            return ALONE
        areas, of_area = {area.id: area.polygon for area in template.areas}, dict[str, list[shapely.Polygon]]()
        for piece in pieces:
            of_area.setdefault(piece.area, []).append(piece.polygon)
        if unknown := [name for name in of_area if name not in areas]:
            raise PlanningError("", f'has a remaining piece of "{unknown[0]}"', "give pieces of the template's areas")
        remaining = {name: shapely.MultiPolygon(parts) for name, parts in of_area.items()}
        return cls(grounds={name: areas[name] for name in remaining}, remaining=remaining)


ALONE: Final = Company()


@dataclass(frozen=True)
class PlanTask:
    """A template in the map frame, the vehicle that shall work on it, and how to plan.

    Attributes:
        template, vehicle, options: What to work on, with what, and how.
        company: Other robots on the ground.
    """

    template: Template
    vehicle: Vehicle
    options: PlanOptions
    company: Company = ALONE

    @cached_property
    def limits(self) -> Limits:
        """Limits of vehicle and options; raises `PlanningError` as `Limits.of` does."""
        return Limits.of(self.vehicle, self.options)
