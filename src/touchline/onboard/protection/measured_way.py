"""Measured way: the clearances along a way that is laid, and where to stop, by one kernel."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.onboard.computer_state import Computer
from touchline.onboard.interface import TICK_S
from touchline.onboard.protection.clearance import HitArrays, measure_clearances
from touchline.onboard.protection.way import find_stop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_BEYOND_M = 1.0
"""Clearance that is measured beyond what can matter before the next scan."""


class HitsInReach(NamedTuple):
    """Memory for the hits in reach of a way.

    Attributes:
        hits: Room for as many as there are; the first of each kind are in use.
        counts: (3,) numbers of those, in the order of `HitArrays`.
    """

    hits: HitArrays
    counts: Integers

    @classmethod
    def sized(cls, points: int) -> HitsInReach:
        """Return memory for this many points of each kind."""
        return cls(HitArrays(*(np.empty((points, 2)) for _ in range(3))), np.zeros(3, np.int64))

    def place(self, index: int) -> Floats:
        """Return the place (2,) of the hit with an index of `WayState.nearest`."""
        moving = int(self.counts[0])
        found: Floats = self.hits.moving_m[index] if index < moving else self.hits.standing_m[index - moving]
        return found.copy()


@kernel
def _keep(points: Floats, east_m: float, north_m: float, reach_m: float, kept: Floats) -> int:
    """Copy the points within a distance of a place; return their number."""
    count = 0
    for i in range(len(points)):
        east, north = points[i, 0] - east_m, points[i, 1] - north_m
        if east * east + north * north < reach_m * reach_m:
            kept[count, 0], kept[count, 1] = points[i, 0], points[i, 1]
            count += 1
    return count


@kernel
def measure_way(computer: Computer, body: Floats, hits: HitArrays, reach: HitsInReach) -> None:
    """Measure the clearances along a way that is laid, and find the place up to which the robot may come to rest.

    Args:
        computer: (1,) whose way has its poses; updated, as by `measure_clearances` and `find_stop`.
        body: (k, 2) outline of the body [m].
        hits: All hits.
        reach: Memory for those in reach, with room for all; filled in.
    """
    way = computer[0].way
    rest_s = way.reaction_s + way.fastest_mps / way.braking_mps2 + way.creep_s
    most_m = _BEYOND_M + way.margin_m + way.error_m + way.thing_mps * (way.silent_ticks * TICK_S + rest_s)
    reach_m = way.horizon_m + way.radius_m + most_m
    near, counts, x, y = reach.hits, reach.counts, way.east_m[0], way.north_m[0]
    counts[0] = _keep(hits.moving_m, x, y, reach_m, near.moving_m)
    counts[1] = _keep(hits.standing_m, x, y, reach_m, near.standing_m)
    counts[2] = _keep(hits.doubtful_m, x, y, reach_m, near.doubtful_m)
    found = HitArrays(near.moving_m[: counts[0]], near.standing_m[: counts[1]], near.doubtful_m[: counts[2]])
    measure_clearances(computer, body, found, most_m)
    find_stop(computer)
