"""Ways of a team's robots: straight, round walls, or through passages."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.free_area import FreeArea
from touchline.coordination.geodesics import Geodesics
from touchline.coordination.plans.next_legs import NextLeg
from touchline.coordination.plans.ordered_ways import OrderedWays
from touchline.coordination.plans.passage_lanes import PassageLanes
from touchline.coordination.plans.passages import find_passages

Complexes = NDArray[np.complex128]


_ROOM_M: Final = 0.05
"""Width that two robots need beside each other in a passage, beyond that of plans, on each side."""


class Ways:
    """Ways within an area.

    Args:
        area: The area.
        wall_m: Distance that plans keep from walls.
        apart_m: Least distance of two robots.
    """

    def __init__(self, area: FreeArea, wall_m: float, apart_m: float) -> None:
        self._geodesics: Geodesics | None = None
        self._lanes: PassageLanes | None = None
        self._ordered: OrderedWays | None = None
        self._maze = False
        if len(area.walls):
            geodesics, two_m = Geodesics(area, wall_m), apart_m + 2.0 * (wall_m + _ROOM_M)
            self._geodesics = geodesics
            passages, others_m = find_passages(area, 2.0 * wall_m)
            self._lanes = PassageLanes(passages, geodesics, apart_m, two_m)
            self._ordered = OrderedWays(geodesics, apart_m)
            self._maze = others_m < two_m

    def sees(self, place: complex, other: complex) -> bool:
        """Return whether the straight way between two places keeps off walls, x + iy each (m)."""
        return self._geodesics is None or self._geodesics.sees(place, other)

    def legs(self, places: Complexes, rests: Complexes, goals: Complexes, now_s: float) -> list[NextLeg]:
        """Return the next part of each robot's way.

        Args:
            places: (n,) of the robots (m).
            rests: (n,) where they would come to rest now (m).
            goals: (n,) m.
            now_s: Time.
        """
        if self._lanes is None or self._ordered is None:
            return [
                NextLeg(goal, abs(goal - place)) for place, goal in zip(places.tolist(), goals.tolist(), strict=True)
            ]
        ordered = None
        if len(places) > 1 and (self._maze or self._lanes.narrow_at(goals)):
            ordered = self._ordered.legs(places, rests, goals)
        return ordered if ordered is not None else self._lanes.legs(places, goals, now_s)
