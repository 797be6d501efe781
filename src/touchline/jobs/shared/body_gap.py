"""Distance between the bodies of robots, by their true poses."""

import math
from collections.abc import Mapping
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from touchline.jobs.shared.timed_path import body_disc
from touchline.schemas.vehicles import Vehicle

Floats = NDArray[np.float64]


class BodyGap:
    """Smallest distance between two body outlines so far.

    Attributes:
        closest_m: The distance; infinite for a single robot.
    """

    def __init__(self, vehicle: Vehicle) -> None:
        """Watch robots of the same kind."""
        self.closest_m = math.inf
        self._outline: Floats = np.array(vehicle.body.footprint_m)
        self._middle, self._radius_m = body_disc(vehicle)
        self._touching: set[tuple[str, str]] = set()

    def look(self, poses: Mapping[str, Floats]) -> list[str]:
        """Add the poses (n, 3) of each robot, all at the same n instants: x (m), y (m), heading (rad), map frame.

        Returns:
            Names of robots that have newly touched another.
        """
        import shapely

        touching = set[tuple[str, str]]()
        for (name, one), (others_name, other) in combinations(poses.items(), 2):
            off = np.hypot(
                *(_carried(one, np.array([self._middle])) - _carried(other, np.array([self._middle])))[:, 0].T
            )
            near = off - 2.0 * self._radius_m < self.closest_m
            if near.any():
                bodies = shapely.polygons(_carried(one[near], self._outline))
                others = shapely.polygons(_carried(other[near], self._outline))
                apart_m = float(np.min(shapely.distance(bodies, others)))
                self.closest_m = min(self.closest_m, apart_m)
                if apart_m == 0.0:
                    touching.add((name, others_name))
        new, self._touching = touching - self._touching, touching
        return sorted({name for pair in new for name in pair})


def _carried(poses: Floats, points: Floats) -> Floats:
    """Transform points (k, 2) of the body to poses (n, 3); returns (n, k, 2)."""
    cos, sin = np.cos(poses[:, 2:]), np.sin(poses[:, 2:])
    x = poses[:, :1] + cos * points[:, 0] - sin * points[:, 1]
    y = poses[:, 1:2] + sin * points[:, 0] + cos * points[:, 1]
    return np.stack((x, y), axis=2)
