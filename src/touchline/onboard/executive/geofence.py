"""Geofence: the region that no part of the robot's body may leave.

It is the template's boundary if there is one, otherwise the convex hull of the ground that the body sweeps along the
plan; in both cases with a margin (`touchline.schemas.onboard.FenceLimits`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.polygons import crossed, off_squared
from touchline.onboard.trajectory.path import poses_along
from touchline.schemas.errors import CommandRefused
from touchline.schemas.onboard import FenceLimits
from touchline.schemas.vehicles import Vehicle

Floats = NDArray[np.float64]

_POSE_EVERY_M: Final = 0.25


@kernel
def _outside(outline: Floats, point: complex) -> float:
    """Signed distance [m] of a point x + iy to an outline (n, 2), negative inside."""
    nearest, inside = math.inf, False
    a = complex(outline[-1, 0], outline[-1, 1])
    for i in range(outline.shape[0]):
        b = complex(outline[i, 0], outline[i, 1])
        nearest = min(nearest, off_squared(point, a, b))
        if crossed(point, a, b):
            inside = not inside
        a = b
    distance = math.sqrt(nearest)
    return -distance if inside else distance


@kernel
def beyond_m(outline: Floats, body: Floats, radius_m: float, east: float, north: float, heading: float) -> float:
    """Compute the distance of the body's farthest corner outside an outline [m]; not above 0 if all of it is inside.

    Args:
        outline: (n, 2) corners in the map frame.
        body: (m, 2) corners of the body in its own frame.
        radius_m: Radius of the circle about the body's origin that holds them; the corners of a body deep inside are
            not checked.
        east: East of the body's origin [m].
        north: North of the body's origin [m].
        heading: Heading of the body [rad].
    """
    middle: float = _outside(outline, complex(east, north)) + radius_m
    if middle <= 0.0:
        return middle
    cos, sin = math.cos(heading), math.sin(heading)
    farthest = -math.inf
    for i in range(body.shape[0]):
        x = east + cos * body[i, 0] - sin * body[i, 1]
        y = north + sin * body[i, 0] + cos * body[i, 1]
        farthest = max(farthest, _outside(outline, complex(x, y)))
    return farthest


class FenceArrays(NamedTuple):
    """A geofence, as `beyond_m` takes it; without corners there is none."""

    outline: Floats
    body: Floats


class Geofence:
    """Fence round a plan.

    Args:
        path: (n, 7) rows of `path.cut_path`.
        boundary: Corners (x, y) of the template's boundary [m]; empty: the plan's surroundings.
        vehicle: Vehicle whose footprint is the body.
        limits: Margins.

    Attributes:
        outline, body, radius_m: As `beyond_m` takes them.
        margin_m: Distance by which the body may be beyond the outline.
        name: Name of the outline, for people.

    Raises:
        CommandRefused: The plan itself leads over the fence.
    """

    def __init__(
        self, path: Floats, boundary: Sequence[tuple[float, float]], vehicle: Vehicle, limits: FenceLimits
    ) -> None:
        self.body: Floats = np.array(vehicle.body.footprint_m, dtype=np.float64)
        self.radius_m = float(np.hypot(*self.body.T).max())
        poses = _poses(path)
        if boundary:
            self.outline: Floats = np.array(boundary, dtype=np.float64)
            self.margin_m, self.name = limits.boundary_margin_m, "the template's boundary"
            worst = max(beyond_m(self.outline, self.body, self.radius_m, *pose) for pose in poses.tolist())
            if worst > self.margin_m:
                raise CommandRefused(f"the plan takes the robot {worst:.2f} m over {self.name}")
        else:
            self.outline = _hull(_swept(poses, self.body))
            self.margin_m, self.name = limits.margin_m, "its plan's surroundings"

    def beyond_m(self, east: float, north: float, heading: float) -> float:
        """Compute the distance by which the body reaches over the fence [m]; not above 0 if inside.

        Args:
            east: East of the body's origin, map frame [m].
            north: North of the body's origin, map frame [m].
            heading: Heading of the body [rad].
        """
        return float(beyond_m(self.outline, self.body, self.radius_m, east, north, heading))


def _poses(path: Floats) -> Floats:
    """Compute (n, 3) x, y, heading of the robot along the path, ends of all rows included."""
    counts = np.ceil(path[:, 4] / _POSE_EVERY_M).astype(np.int64) + 1
    rows = np.repeat(path, counts, axis=0)
    place = np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)
    local = rows[:, 4] * place / np.maximum(np.repeat(counts, counts) - 1, 1)
    return poses_along(rows, local)


def _swept(poses: Floats, body: Floats) -> Floats:
    """Compute (n·m, 2) the body's corners at all poses."""
    cos, sin = np.cos(poses[:, 2:3]), np.sin(poses[:, 2:3])
    x = poses[:, 0:1] + cos * body[:, 0] - sin * body[:, 1]
    y = poses[:, 1:2] + sin * body[:, 0] + cos * body[:, 1]
    return np.column_stack((x.ravel(), y.ravel()))


def _hull(points: Floats) -> Floats:
    """Compute (n, 2) the corners of the points' convex hull."""
    import shapely

    return shapely.get_coordinates(shapely.LineString(points).convex_hull)[:-1]
