"""Ways of a team's robots: straight, round walls, or through passages."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.free_area import FreeArea
from touchline.coordination.plans.geodesics import Geodesics
from touchline.coordination.plans.lanes import Lanes
from touchline.coordination.plans.legs import Leg
from touchline.coordination.plans.passages import find_passages

Complexes = NDArray[np.complex128]


class Ways:
    """Ways within an area.

    Args:
        area: The area.
        wall_m: Distance that plans keep from walls.
        apart_m: Least distance of two robots.
    """

    def __init__(self, area: FreeArea, wall_m: float, apart_m: float) -> None:
        self._lanes: Lanes | None = None
        if len(area.walls):
            self._lanes = Lanes(find_passages(area, apart_m), Geodesics(area, wall_m), apart_m)

    def legs(self, places: Complexes, goals: Complexes) -> list[Leg]:
        """Return the next part of each robot's way.

        Args:
            places: (n,) of the robots (m).
            goals: (n,) m.
        """
        if self._lanes is not None:
            return self._lanes.legs(places, goals)
        return [Leg(goal, abs(goal - place)) for place, goal in zip(places.tolist(), goals.tolist(), strict=True)]
