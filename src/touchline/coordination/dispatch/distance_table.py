"""Table of the lengths of ways between the places of tasks, docks and robots."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.free_area import FreeArea
from touchline.coordination.geodesics import Geodesics
from touchline.schemas.errors import SpecError

Floats = NDArray[np.float64]


class DistanceTable:
    """Lengths of shortest ways, round walls if the area has any; those to known places are kept.

    Args:
        area: The area.
        wall_m: Distance that robots keep from walls.
    """

    def __init__(self, area: FreeArea, wall_m: float) -> None:
        self._area, self._wall_m = area, wall_m
        self.geodesics = Geodesics(area, wall_m) if len(area.walls) else None
        self._fields: dict[complex, Floats] = {}

    def check(self, source: str, field: str, place: complex) -> None:
        """Check that robots can be at a place, x + iy (m).

        Raises:
            SpecError: It is not in the area, or too near to a wall.
        """
        if not self._area.holds(np.array([(place.real, place.imag)]), self._wall_m)[0]:
            where = f"is ({place.real:g}, {place.imag:g}) m, not in the area or within {self._wall_m:g} m of a wall"
            raise SpecError(source, field, where, "give a place that robots can be at")

    def lengths_m(self, places: Sequence[complex], goals: Sequence[complex]) -> Floats:
        """Return (n, m) the length of the way from each place to each goal, x + iy (m); inf: there is none."""
        at, ends = np.array(places, dtype=np.complex128), np.array(goals, dtype=np.complex128)
        direct: Floats = np.abs(at[:, None] - ends[None, :])
        if (geodesics := self.geodesics) is None or not at.size or not ends.size:
            return direct
        new = [goal for goal in dict.fromkeys(goals) if goal not in self._fields]
        for goal, field in zip(new, geodesics.fields_m(new), strict=True):
            self._fields[goal] = field
        nodes = geodesics.nearest_nodes(at)
        by_grid = np.array([self._fields[goal][nodes] for goal in goals]).T
        return np.ascontiguousarray(np.maximum(direct, by_grid))

    def aim(self, place: complex, goal: complex) -> complex:
        """Return the farthest point of the way from a place to a goal (m) that is seen from there."""
        return goal if self.geodesics is None else self.geodesics.way(place, goal)[0]
