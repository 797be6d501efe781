"""Contacts of a team's robots with each other and with walls, by their true places in every tick; bodies are discs."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.fleet.free_area import FreeArea
from touchline.schemas.faults import Bumper
from touchline.schemas.vehicles import Vehicle

Floats = NDArray[np.float64]

PRESSED: Final = Bumper(kind="bumper", duration_s=1.0)
"""What happens to each of two robots that have come to touch."""


class BodyContacts:
    """Counts contacts; who stays in contact counts once.

    Attributes:
        pairs: Who has touched whom, by their numbers, once for each contact.
        at_walls: Who has touched a wall or an obstacle, likewise.
        closest_m: The least distance of two centres so far.
    """

    def __init__(self, robots: int, body_radius_m: float, area: FreeArea) -> None:
        """Nobody has touched anything.

        Args:
            robots: How many there are.
            body_radius_m: Of each.
            area: Between whose walls they drive.
        """
        self._first, self._second = np.triu_indices(robots, 1)
        self._radius_m, self._area = body_radius_m, area
        self._touching = np.zeros(len(self._first), dtype=np.bool_)
        self._at_wall: NDArray[np.bool_] | None = None
        self.at_walls: list[int] = []
        self.pairs: list[tuple[int, int]] = []
        self.closest_m = math.inf

    def look(self, places: Floats) -> set[int]:
        """Count what is new; returns the robots that have come to touch another or a wall.

        Args:
            places: (ticks, n, 2) in order (m); not a number where nobody is.
        """
        return self._look_at_walls(places) | self._look_at_pairs(places)

    def _look_at_walls(self, places: Floats) -> set[int]:
        if self._at_wall is None:  # who begins there has not run into anything
            self._at_wall = self._touches(places[0], self._radius_m)
        steps = np.diff(places, axis=0)
        reach_m = np.nan_to_num(np.hypot(steps[..., 0], steps[..., 1]).sum(axis=0))
        near = np.flatnonzero(self._touches(places[-1], self._radius_m + reach_m))
        found: set[int] = set()
        at_wall: NDArray[np.bool_] = np.zeros(places.shape[1], dtype=np.bool_)
        for robot in near.tolist():
            touching: NDArray[np.bool_] = self._touches(places[:, robot], self._radius_m)
            begun = np.flatnonzero(np.diff(touching.astype(np.int8), prepend=int(self._at_wall[robot])) > 0)
            self.at_walls += [robot] * len(begun)
            if len(begun):
                found.add(robot)
            at_wall[robot] = touching[-1]
        self._at_wall = at_wall
        return found

    def _touches(self, places: Floats, radius_m: float | Floats) -> NDArray[np.bool_]:
        """True for discs (n,) that touch a wall or are beyond it; nobody is where there is no number."""
        there = np.isfinite(places[:, 0])
        found: NDArray[np.bool_] = there & ~self._area.holds(np.nan_to_num(places), radius_m)
        return found

    def _look_at_pairs(self, places: Floats) -> set[int]:
        if not len(self._first):
            return set()
        between = places[:, self._first] - places[:, self._second]
        apart_m = np.hypot(between[..., 0], between[..., 1])
        self.closest_m = float(np.fmin.reduce(apart_m, axis=None, initial=self.closest_m))
        touching = apart_m < 2.0 * self._radius_m
        new = touching & ~np.vstack((self._touching[None], touching[:-1]))
        self._touching = touching[-1]
        found = [(int(self._first[pair]), int(self._second[pair])) for pair in np.flatnonzero(new) % len(self._first)]
        self.pairs += found
        return {robot for pair in found for robot in pair}


def body_radius_m(vehicle: Vehicle) -> float:
    """Of the disc about a vehicle's centre that holds its body (m)."""
    return float(np.hypot(*np.array(vehicle.body.footprint_m).T).max())
