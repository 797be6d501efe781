"""Clearance: distance from the body's outline to the nearest of many points, at one pose or along a way."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.polygons import crossed, off_squared
from touchline.onboard.computer_state import Computer

Floats = NDArray[np.float64]


class HitArrays(NamedTuple):
    """Hits in reach of a way, (n, 2) each, map frame [m].

    Attributes:
        moving_m: Of things that may move.
        standing_m: Of things that the plan knows, which stand.
        doubtful_m: What may be ground.
    """

    moving_m: Floats
    standing_m: Floats
    doubtful_m: Floats


@kernel
def clearance(
    body: Floats, radius_m: float, pose: tuple[float, float, float], points: Floats, most_m: float
) -> tuple[float, int]:
    """Return the distance [m] from the body to the nearest point, exactly; negative if that point is inside.

    Args:
        body: (k, 2) outline of the body in its own frame [m].
        radius_m: Distance of its farthest corner from its origin.
        pose: East, north [m], map frame, and heading [rad] of the body.
        points: (n, 2) points, map frame [m].
        most_m: Distance at which the search ends.

    Returns:
        Distance, at most `most_m`, and the index of the point; −1 if all are farther away.
    """
    best, nearest = most_m, -1
    if len(points) == 0:
        return best, nearest
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    for i in range(len(points)):
        east, north = points[i, 0] - pose[0], points[i, 1] - pose[1]
        reach = best + radius_m
        if reach <= 0.0 or east * east + north * north >= reach * reach:
            continue
        point = complex(cos * east + sin * north, cos * north - sin * east)
        squared, inside = math.inf, False
        a = complex(body[-1, 0], body[-1, 1])
        for k in range(len(body)):
            b = complex(body[k, 0], body[k, 1])
            squared = min(squared, off_squared(point, a, b))
            if crossed(point, a, b):
                inside = not inside
            a = b
        distance = -math.sqrt(squared) if inside else math.sqrt(squared)
        if distance < best:
            best, nearest = distance, i
    return best, nearest


@kernel
def measure_clearances(computer: Computer, body: Floats, hits: HitArrays, most_m: float) -> None:
    """Fill in the clearances along a way: `clear_m`, `standing_m`, `slack_m`, `nearest` and `slow_m`.

    Between two poses no part of the body is farther from where it is at the nearer one than half of what the farthest
    corner moves, so what the poses see holds for all between.

    Args:
        computer: (1,) whose way has its poses; updated.
        body: (k, 2) outline of the body [m].
        hits: Hits.
        most_m: Clearance beyond which it does not matter.
    """
    way = computer[0].way
    way.slow_m = math.inf
    moved_m, last = 0.0, len(way.ahead_m) - 1
    for j in range(last + 1):
        before_m, moved_m = moved_m, 0.0
        if j < last:
            east, north = way.east_m[j + 1] - way.east_m[j], way.north_m[j + 1] - way.north_m[j]
            turned = abs(way.heading_rad[j + 1] - way.heading_rad[j])
            moved_m = 0.5 * (math.sqrt(east * east + north * north) + way.radius_m * turned)
        way.slack_m[j] = max(before_m, moved_m)
        pose = way.east_m[j], way.north_m[j], way.heading_rad[j]
        clear_m, nearest = clearance(body, way.radius_m, pose, hits.moving_m, most_m)
        standing_m, known = clearance(body, way.radius_m, pose, hits.standing_m, most_m)
        if standing_m < clear_m:
            nearest = len(hits.moving_m) + known
        way.clear_m[j], way.standing_m[j] = clear_m - way.slack_m[j], standing_m - way.slack_m[j]
        way.nearest[j] = nearest
        if math.isinf(way.slow_m):
            kept_m = way.margin_m + way.error_m + way.slack_m[j]
            if clearance(body, way.radius_m, pose, hits.doubtful_m, kept_m)[1] >= 0:
                way.slow_m = way.ahead_m[j]
