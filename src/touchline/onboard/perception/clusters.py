"""Clusters of returns: each the visible side of a thing, or of both legs of a person.

They end where neighbours are farther apart than an adaptive breakpoint (G. A. Borges, M.-J. Aldon, Line extraction in
2D range images for mobile robotics, J. Intelligent and Robotic Systems 40, 2004).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import borrowing, kernel
from touchline.onboard.perception.scan import THING, Beams, ScanFigures, sigma_of

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

MOST: Final = 128
"""Largest number of clusters of a scan; returns beyond them form none."""
DIRECTIONS: Final = 16
"""Directions, evenly spaced from east, in which the extreme points of a cluster are kept: its convex hull."""

_BREAK_M: Final = 0.1
_CORNER_M: Final = 0.2
"""Depth of a corner that is seen from inside, from which on its sides are two clusters: their hull would be free."""
LEG_M: Final = 0.3
"""Largest width of a leg, with noise."""
STEP_M: Final = 0.75
"""Largest distance between the legs of a person, with noise."""
_ROUND_SHARE: Final = 0.39
"""Distance of a leg's centre behind the mean of its visible points, as a share of its diameter: π/8 of a circle."""

_ANGLES = np.arange(DIRECTIONS) * math.tau / DIRECTIONS
UNIT: Final = np.stack((np.cos(_ANGLES), np.sin(_ANGLES)), 1)
"""(DIRECTIONS, 2) unit vectors."""


class Clusters(NamedTuple):
    """Memory for the clusters of a scan; `found` has their number, the first rows of all others are theirs.

    Attributes:
        found: (1,) number of clusters.
        centre_m: (MOST, 2) centre of each.
        width_m: (MOST, 2) largest width, and the smallest, over the directions.
        legs: (MOST,) 2 if a cluster is two legs, else 1.
        time_s: (MOST,) time of measurement.
        hull_m: (MOST, DIRECTIONS, 2) extreme point in each direction.
        order: (beams,) beams with things, in their order.
        ends: (MOST, 2) first and last place in `order` of what is still to be split.
    """

    found: Integers
    centre_m: Floats
    width_m: Floats
    legs: Integers
    time_s: Floats
    hull_m: Floats
    order: Integers
    ends: Integers

    @classmethod
    def of(cls, beams: int) -> Self:
        """Return memory for the scans of a lidar with this number of beams."""
        count, legs, order = np.zeros(1, np.int64), np.ones(MOST, np.int64), np.zeros(beams, np.int64)
        pairs, hull = (np.zeros((MOST, 2)), np.zeros((MOST, 2))), np.zeros((MOST, DIRECTIONS, 2))
        return cls(count, *pairs, legs, np.zeros(MOST), hull, order, np.zeros((MOST, 2), np.int64))


@kernel
def widen(hull: Floats, x: float, y: float, unit: Floats) -> None:
    """Take a point into a hull.

    Args:
        hull: (DIRECTIONS, 2) extreme points; changed.
        x: The point, with `y`.
        y: Its other coordinate.
        unit: (DIRECTIONS, 2) unit vectors.
    """
    for k in range(DIRECTIONS):
        if (x - hull[k, 0]) * unit[k, 0] + (y - hull[k, 1]) * unit[k, 1] > 0.0:
            hull[k, 0], hull[k, 1] = x, y


@kernel
def widths_of(hull: Floats, unit: Floats) -> tuple[float, float]:
    """Return the largest width of a hull and the smallest, over the directions [m]."""
    most, least = 0.0, math.inf
    half = DIRECTIONS // 2
    for k in range(half):
        width = (hull[k, 0] - hull[k + half, 0]) * unit[k, 0] + (hull[k, 1] - hull[k + half, 1]) * unit[k, 1]
        most, least = max(most, width), min(least, width)
    return most, least


@kernel
def _apart(a: Floats, b: Floats) -> float:
    return math.hypot(a[0] - b[0], a[1] - b[1])


@kernel
def _broken(lidar: ScanFigures, beams: Beams, i: int, j: int) -> bool:
    """Return whether the returns of two beams, one after the other, belong to different things."""
    near = min(beams.range_m[i], beams.range_m[j])
    most = _BREAK_M + 2.0 * near * lidar.step_rad + 3.0 * sigma_of(lidar, near)
    return bool(_apart(beams.points_m[i], beams.points_m[j]) > most)


@kernel
def _corner(lidar: ScanFigures, beams: Beams, first: int, last: int, order: Integers) -> int:
    """Return the place of a corner seen from inside, which splits a cluster; −1 if it has none."""
    a, b = beams.points_m[order[first]], beams.points_m[order[last]]
    x, y = b[0] - a[0], b[1] - a[1]
    length = math.hypot(x, y)
    if length == 0.0:
        return -1
    place, deepest = -1, (_CORNER_M + 3.0 * sigma_of(lidar, beams.range_m[order[first]])) * length
    for k in range(first + 1, last):
        point = beams.points_m[order[k]]
        depth = y * (point[0] - a[0]) - x * (point[1] - a[1])  # to the right: beams run counter-clockwise
        if depth > deepest:
            place, deepest = k, depth
    return place


@kernel
def _describe(beams: Beams, first: int, last: int, unit: Floats, clusters: Clusters) -> None:
    """Append the cluster of the returns from one place of the order to another."""
    n = clusters.found[0]
    if n == MOST:
        return
    clusters.found[0] = n + 1
    hull = clusters.hull_m[n]
    start = beams.points_m[clusters.order[first]]
    for k in range(DIRECTIONS):
        hull[k, 0], hull[k, 1] = start[0], start[1]
    x, y, time_s = 0.0, 0.0, 0.0
    for k in range(first, last + 1):
        i = clusters.order[k]
        point = beams.points_m[i]
        x, y, time_s = x + point[0], y + point[1], time_s + beams.time_s[i]
        widen(hull, point[0], point[1], unit)
    count = last - first + 1
    x, y = x / count, y / count
    most, least = widths_of(hull, unit)
    ray = beams.rays[clusters.order[(first + last) // 2]]
    behind = _ROUND_SHARE * most if most <= LEG_M else 0.0
    clusters.centre_m[n, 0], clusters.centre_m[n, 1] = x + behind * ray[2], y + behind * ray[3]
    clusters.width_m[n, 0], clusters.width_m[n, 1] = most, least
    clusters.legs[n], clusters.time_s[n] = 1, time_s / count


@kernel
def _split(lidar: ScanFigures, beams: Beams, first: int, last: int, unit: Floats, clusters: Clusters) -> None:
    """Append the clusters of a run of returns without breaks: one, or several where it has corners."""
    ends, waiting = clusters.ends, 1
    ends[0, 0], ends[0, 1] = first, last
    while waiting > 0:
        waiting -= 1
        a, b = ends[waiting, 0], ends[waiting, 1]
        corner = _corner(lidar, beams, a, b, clusters.order) if waiting + 2 < MOST else -1
        if corner < 0:
            _describe(beams, a, b, unit, clusters)
        else:
            ends[waiting, 0], ends[waiting, 1] = corner + 1, b
            ends[waiting + 1, 0], ends[waiting + 1, 1] = a, corner
            waiting += 2


@kernel
def _nearest_leg(n: int, clusters: Clusters) -> int:
    """Return the leg that is nearest to another one, within a step of it; −1 if there is none."""
    found, least = -1, STEP_M
    for k in range(clusters.found[0]):
        apart = _apart(clusters.centre_m[n], clusters.centre_m[k])
        if k != n and clusters.width_m[k, 0] <= LEG_M and clusters.legs[k] == 1 and apart <= least:
            found, least = k, apart
    return found


@kernel
def _merge_legs(unit: Floats, clusters: Clusters) -> None:
    """Merge pairs of legs, each the nearest to the other."""
    n = 0
    while n < clusters.found[0]:
        k = -1
        if clusters.width_m[n, 0] <= LEG_M and clusters.legs[n] == 1:
            k = _nearest_leg(n, clusters)
        if k > n and _nearest_leg(k, clusters) == n:
            _merge(n, k, unit, clusters)
        n += 1


@kernel
def _merge(n: int, k: int, unit: Floats, clusters: Clusters) -> None:
    """Merge a cluster into another; the last one takes its place."""
    for axis in range(2):
        clusters.centre_m[n, axis] = 0.5 * (clusters.centre_m[n, axis] + clusters.centre_m[k, axis])
    for d in range(DIRECTIONS):
        widen(clusters.hull_m[n], clusters.hull_m[k, d, 0], clusters.hull_m[k, d, 1], unit)
    clusters.width_m[n, 0], clusters.width_m[n, 1] = widths_of(clusters.hull_m[n], unit)
    clusters.legs[n], clusters.time_s[n] = 2, 0.5 * (clusters.time_s[n] + clusters.time_s[k])
    last = clusters.found[0] - 1
    clusters.found[0] = last
    for d in range(DIRECTIONS):
        for axis in range(2):
            clusters.hull_m[k, d, axis] = clusters.hull_m[last, d, axis]
    for axis in range(2):
        clusters.centre_m[k, axis] = clusters.centre_m[last, axis]
        clusters.width_m[k, axis] = clusters.width_m[last, axis]
    clusters.legs[k], clusters.time_s[k] = clusters.legs[last], clusters.time_s[last]


@borrowing
def form_clusters(lidars: Sequence[ScanFigures], beams: Beams, unit: Floats, clusters: Clusters) -> None:
    """Form the clusters of a scan's things.

    Args:
        lidars: (1,) data sheet.
        beams: The scan, with its kinds.
        unit: (DIRECTIONS, 2) unit vectors.
        clusters: Filled in.
    """
    lidar, order, count = lidars[0], clusters.order, 0
    for i in range(len(beams.kind)):
        if beams.kind[i] == THING:
            order[count] = i
            count += 1
    clusters.found[0] = 0
    if count == 0:
        return
    start = 0  # all round it begins after a break, so that none is cut at the first beam
    if lidar.round and not _broken(lidar, beams, order[count - 1], order[0]):
        for k in range(1, count):
            if _broken(lidar, beams, order[k - 1], order[k]):
                start = k
                break
    if start > 0:
        place, i = 0, order[start]
        for k in range(len(beams.kind)):
            b = (i + k) % len(beams.kind)
            if beams.kind[b] == THING:
                order[place] = b
                place += 1
    first = 0
    for k in range(1, count + 1):
        if k == count or _broken(lidar, beams, order[k - 1], order[k]):
            _split(lidar, beams, first, k - 1, unit, clusters)
            first = k
    _merge_legs(unit, clusters)
