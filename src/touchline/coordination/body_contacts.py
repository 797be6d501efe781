"""Contacts of a team's robots with each other and with walls, by their true places in every tick; bodies are discs."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.free_area import FreeArea
from touchline.schemas.faults import Bumper
from touchline.schemas.vehicles import Vehicle

Floats = NDArray[np.float64]

PRESSED: Final = Bumper(kind="bumper", duration_s=1.0)
"""Fault of each of two robots in contact."""


class BodyContacts:
    """Counter of contacts; one that lasts counts once.

    Attributes:
        pairs: Numbers of two robots, once for each of their contacts.
        at_walls: Numbers of robots, once for each contact with a wall or an obstacle.
        closest_m: Smallest distance of two centres so far.
    """

    def __init__(self, robots: int, body_radius_m: float, area: FreeArea) -> None:
        """Start without contacts.

        Args:
            robots: Number of robots.
            body_radius_m: Radius of each.
            area: Area with walls.
        """
        self._first, self._second = np.triu_indices(robots, 1)
        self._radius_m, self._area = body_radius_m, area
        self._touching = np.zeros(len(self._first), dtype=np.bool_)
        self._at_wall: NDArray[np.bool_] | None = None
        self.at_walls: list[int] = []
        self.pairs: list[tuple[int, int]] = []
        self.closest_m = math.inf

    def look(self, places: Floats) -> set[int]:
        """Count new contacts; return the robots that newly touch another or a wall.

        Args:
            places: (ticks, n, 2) in order (m, map frame); NaN for absent robots.
        """
        return self._look_at_walls(places) | self._look_at_pairs(places)

    def _look_at_walls(self, places: Floats) -> set[int]:
        if self._at_wall is None:  # a robot that starts there has not run into anything
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
        """Return whether discs (n,) touch a wall or are beyond it; False for NaN."""
        there = np.isfinite(places[:, 0])
        found: NDArray[np.bool_] = there & ~self._area.holds(np.nan_to_num(places), radius_m)
        return found

    def _look_at_pairs(self, places: Floats) -> set[int]:
        if not len(self._first):
            return set()
        near = self._near(places)
        first, second = self._first[near], self._second[near]
        between = places[:, first] - places[:, second]
        apart_m = np.hypot(between[..., 0], between[..., 1])
        self.closest_m = float(np.fmin.reduce(apart_m, axis=None, initial=self.closest_m))
        touching = apart_m < 2.0 * self._radius_m
        new = touching & ~np.vstack((self._touching[None, near], touching[:-1]))
        self._touching[:] = False
        self._touching[near] = touching[-1]
        found = [(int(first[pair]), int(second[pair])) for pair in (np.flatnonzero(new) % max(len(near), 1)).tolist()]
        self.pairs += found
        return {robot for pair in found for robot in pair}

    def _near(self, places: Floats) -> NDArray[np.int64]:
        """Return the numbers of the pairs that may come to touch, or nearer than any before."""
        steps = np.diff(places, axis=0)
        reach_m = np.hypot(steps[..., 0], steps[..., 1]).sum(axis=0)
        off_m = np.hypot(*(places[0, self._first] - places[0, self._second]).T)
        far = off_m - reach_m[self._first] - reach_m[self._second] > max(2.0 * self._radius_m, self.closest_m)
        return np.flatnonzero(~far)  # NaN is not far


def body_radius_m(vehicle: Vehicle) -> float:
    """Return the radius of the disc about a vehicle's centre that holds its body (m)."""
    return float(np.hypot(*np.array(vehicle.body.footprint_m).T).max())
