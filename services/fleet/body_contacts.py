"""Which robots of a team touch each other, by their true places in every tick; bodies are discs."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.faults import Bumper
from touchline.schemas.vehicles import Vehicle

Floats = NDArray[np.float64]

PRESSED: Final = Bumper(kind="bumper", duration_s=1.0)
"""What happens to each of two robots that have come to touch."""


class BodyContacts:
    """Counts contacts; two robots that stay in contact count once.

    Attributes:
        pairs: Who has touched whom, by their numbers, once for each contact.
        closest_m: The least distance of two centres so far.
    """

    def __init__(self, robots: int, body_radius_m: float) -> None:
        """Nobody has touched anybody.

        Args:
            robots: How many there are.
            body_radius_m: Of each.
        """
        self._first, self._second = np.triu_indices(robots, 1)
        self._apart_m = 2.0 * body_radius_m
        self._touching = np.zeros(len(self._first), dtype=np.bool_)
        self.pairs: list[tuple[int, int]] = []
        self.closest_m = math.inf

    def look(self, places: Floats) -> set[int]:
        """Count what is new; returns the robots that have come to touch another.

        Args:
            places: (ticks, n, 2) in order (m); not a number where nobody is.
        """
        if not len(self._first):
            return set()
        between = places[:, self._first] - places[:, self._second]
        apart_m = np.hypot(between[..., 0], between[..., 1])
        self.closest_m = float(np.fmin.reduce(apart_m, axis=None, initial=self.closest_m))
        touching = apart_m < self._apart_m
        new = touching & ~np.vstack((self._touching[None], touching[:-1]))
        self._touching = touching[-1]
        found = [(int(self._first[pair]), int(self._second[pair])) for pair in np.flatnonzero(new) % len(self._first)]
        self.pairs += found
        return {robot for pair in found for robot in pair}


def body_radius_m(vehicle: Vehicle) -> float:
    """Of the disc about a vehicle's centre that holds its body (m)."""
    return float(np.hypot(*np.array(vehicle.body.footprint_m).T).max())
