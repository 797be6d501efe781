"""Way that a trajectory leads a robot's body, pose by pose, and its distance from things."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from touchline.core.jit import kernel
from touchline.onboard.protection.clearance import clearance
from touchline.schemas.curves import Curve, spin_rad
from touchline.schemas.messages import LinearDirection, Trajectory

Floats = NDArray[np.float64]

STEP_M: Final = 0.05
STEP_RAD: Final = 0.1
"""Largest steps from pose to pose."""


@kernel
def _least_clearance(body: Floats, radius_m: float, poses: Floats, points: Floats, most_m: float) -> float:
    """Return the least distance [m] of the body from points at some poses (n, 3); at most `most_m`."""
    least_m = most_m
    for k in range(len(poses)):
        least_m = clearance(body, radius_m, (poses[k, 0], poses[k, 1], poses[k, 2]), points, least_m)[0]
    return least_m


class WayAhead(NamedTuple):
    """Way of a body along a trajectory.

    Attributes:
        station_m: (n,) arc length of each pose.
        poses: (n, 3) x (m), y (m), heading (rad), map frame.
        backward: (n,) True where the robot drives backward.
    """

    station_m: Floats
    poses: Floats
    backward: NDArray[np.bool_]

    @classmethod
    def of(cls, trajectory: Trajectory) -> WayAhead:
        """Return the way of a trajectory."""
        rows: list[Floats] = []
        at_m = 0.0
        for segment in trajectory.path.segments:
            turn = spin_rad(segment.curve)
            if turn is not None:
                if rows:
                    turned = np.linspace(0.0, turn, 2 + int(abs(turn) / STEP_RAD))[1:]
                    rows.append(rows[-1][-1] + turned[:, None] * (0.0, 0.0, 0.0, 1.0, 0.0))
                continue
            curve, back = Curve.from_message(segment.curve), segment.direction.value == LinearDirection.BACKWARD
            along = np.linspace(0.0, curve.length_m, 2 + int(curve.length_m / STEP_M))
            x, y, heading, _ = curve.at(along)
            heading = heading + (math.pi if back else 0.0)
            rows.append(np.column_stack((at_m + along, x, y, heading, np.full(len(along), float(back)))))
            at_m += curve.length_m
        table = np.concatenate(rows)
        return cls(table[:, 0], np.ascontiguousarray(table[:, 1:4]), table[:, 4] > 0.0)

    @classmethod
    def at(cls, pose: Sequence[float]) -> WayAhead:
        """Return the way of a robot that stands at a pose."""
        return cls(np.zeros(1), np.array([pose]), np.zeros(1, np.bool_))

    @classmethod
    def back(cls, start: Sequence[float], end: Sequence[float]) -> WayAhead:
        """Return the way straight back from a pose to another with the same heading."""
        far_m = math.hypot(end[0] - start[0], end[1] - start[1])
        along = np.linspace(0.0, far_m, 2 + int(far_m / STEP_M))
        return cls(along, np.linspace(start, end, len(along)), np.ones(len(along), np.bool_))

    def from_station(self, station_m: float) -> WayAhead:
        """Return the rest of the way from an arc length on."""
        return self.where(self.station_m >= min(station_m, float(self.station_m[-1])))

    def where(self, chosen: NDArray[np.bool_]) -> WayAhead:
        """Return the chosen poses."""
        return WayAhead(self.station_m[chosen], self.poses[chosen], self.backward[chosen])

    def swept(self, body: Floats, margin_m: float) -> BaseGeometry:
        """Return the ground that a body sweeps with a margin; arguments as in `clearance_m`."""
        cos, sin = np.cos(self.poses[:, 2, None]), np.sin(self.poses[:, 2, None])
        x, y = body.T
        corners = np.stack((cos * x - sin * y, sin * x + cos * y), axis=-1) + self.poses[:, None, :2]
        return shapely.union_all(shapely.polygons(corners)).buffer(margin_m)

    def clearance_m(self, body: Floats, things_m: Floats, most_m: float) -> float:
        """Return the least distance of a body from things along the way; negative if it meets one.

        Args:
            body: (k, 2) outline of the body in its own frame, m.
            things_m: (n, 2) points of things, map frame.
            most_m: Distance beyond which it does not matter.
        """
        if not len(self.poses):
            return most_m
        radius_m = float(np.hypot(*body.T).max())
        reach_m = radius_m + most_m
        low, high = self.poses[:, :2].min(axis=0) - reach_m, self.poses[:, :2].max(axis=0) + reach_m
        near = np.ascontiguousarray(things_m[np.all((things_m >= low) & (things_m <= high), axis=1)])
        return float(_least_clearance(body, radius_m, self.poses, near, most_m))
