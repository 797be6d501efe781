"""Kernels: division of an area among robots; see `cells.py` for the definition of cells."""

import math

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.kernels.clipping import clip, clip_all
from touchline.coordination.kernels.nearest import nearest_pair
from touchline.core.half_planes import NORMAL_X, NORMAL_Y, OFFSET
from touchline.core.jit import kernel
from touchline.core.polygons import apart_squared

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@kernel
def bisecting(points: Floats, pieces: Floats, sizes: Ints) -> tuple[Floats, Ints]:
    """Return the Voronoi cells of points in an area that is given as convex pieces.

    Args:
        points: (n, 2) m, all different.
        pieces: (p, m, 2) corners of each piece, counter-clockwise, m.
        sizes: (p,) number of corners of each.

    Returns:
        (n, p, m + n, 2) corners of each cell's part of each piece (m), and (n, p) how many it has.
    """
    n, p, most = len(points), len(pieces), pieces.shape[1] + len(points)
    parts, counts = np.zeros((n, p, most, 2)), np.zeros((n, p), np.int64)
    rows, spare = np.zeros((n, 3)), np.empty((most, 2))
    for i in range(n):
        for j in range(n):
            x, y = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
            apart = math.hypot(x, y)
            rows[j, NORMAL_X] = x / apart if j != i else 0.0
            rows[j, NORMAL_Y] = y / apart if j != i else 0.0
            middle_x, middle_y = 0.5 * (points[i, 0] + points[j, 0]), 0.5 * (points[i, 1] + points[j, 1])
            rows[j, OFFSET] = rows[j, NORMAL_X] * middle_x + rows[j, NORMAL_Y] * middle_y
        for k in range(p):
            counts[i, k] = clip_all(pieces[k], sizes[k], rows, spare, parts[i, k])
    return parts, counts


@kernel
def between(first: Floats, second: Floats, radius: float) -> tuple[float, float, float, float]:
    """Return the strip that keeps two segments apart: of width 2·radius, or of their distance if that is less.

    Args:
        first: (4,) x₁ y₁ x₂ y₂ of a segment, m.
        second: (4,) of another.
        radius: m.

    Returns:
        Unit normal from the first to the second, and n·q at the two sides of the strip (m), the first segment's first;
        a normal of (0, 0) if the segments meet: nothing keeps them apart then.
    """
    a, b = nearest_pair(
        complex(first[0], first[1]),
        complex(first[2], first[3]),
        complex(second[0], second[1]),
        complex(second[2], second[3]),
    )
    gap = abs(b - a)
    if gap == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    n, middle, margin = (b - a) / gap, 0.5 * (a + b), min(radius, 0.5 * gap)
    at = n.real * middle.real + n.imag * middle.imag
    return n.real, n.imag, at - margin, at + margin


@kernel
def keep_apart(segments: Floats, radius: float, rows: Floats) -> tuple[int, int]:
    """Compute the half-planes that keep every two robots apart.

    Args:
        segments: (n, 4) x₁ y₁ x₂ y₂ of each robot's stopping segment, m.
        radius: r_s (m).
        rows: (n, n or more, 3) row j of robot i is filled with the half-plane that keeps i from j; row i stays.

    Returns:
        The first two robots whose segments meet, or (−1, −1).
    """
    for i in range(len(segments)):
        for j in range(i + 1, len(segments)):
            x, y, mine, others = between(segments[i], segments[j], radius)
            if x == 0.0 and y == 0.0:
                return i, j
            rows[i, j, NORMAL_X], rows[i, j, NORMAL_Y], rows[i, j, OFFSET] = x, y, mine
            rows[j, i, NORMAL_X], rows[j, i, NORMAL_Y], rows[j, i, OFFSET] = -x, -y, -others
    return -1, -1


@kernel
def least_apart_m(segments: Floats) -> float:
    """Return the smallest distance (m) of any two of (n, 4) segments x₁ y₁ x₂ y₂ (m); inf for a single one."""
    least = math.inf
    for i in range(len(segments)):
        for j in range(i + 1, len(segments)):
            one, other = segments[i], segments[j]
            least = min(
                least,
                apart_squared(
                    complex(one[0], one[1]),
                    complex(one[2], one[3]),
                    complex(other[0], other[1]),
                    complex(other[2], other[3]),
                ),
            )
    return math.sqrt(least)


@kernel
def keep_within(segment: Floats, sides: Floats, radius: float, rows: Floats) -> None:
    """Compute half-planes of straight sides with all of the area on one side, moved in by the radius.

    A robot that is nearer to one already, or beyond it, may stay there, but get no farther.

    Args:
        segment: (4,) of the robot, m.
        sides: (h, 3) NORMAL_X to OFFSET.
        radius: m.
        rows: (h or more, 3) filled.
    """
    for k in range(len(sides)):
        x, y = sides[k, NORMAL_X], sides[k, NORMAL_Y]
        out = max(x * segment[0] + y * segment[1], x * segment[2] + y * segment[3])
        rows[k, NORMAL_X], rows[k, NORMAL_Y] = x, y
        rows[k, OFFSET] = max(sides[k, OFFSET] - radius, out)


@kernel
def keep_off(segment: Floats, walls: Floats, radius: float, rows: Floats, polygon: Floats, count: int) -> int:
    """Compute half-planes that keep a robot off walls, the nearest first; a wall out of reach of the cell needs none.

    Args:
        segment: (4,) of the robot, m.
        walls: (e, 4) x₁ y₁ x₂ y₂ of each, m.
        radius: m.
        rows: (e, 3) filled; zero where a wall needs none.
        polygon: (count + e or more, 2) corners of the cell so far, which is clipped.
        count: Number of corners.

    Returns:
        Number of corners of the clipped cell, or −1 if the segment meets a wall.
    """
    done, spare = np.zeros(len(walls), np.bool_), np.empty_like(polygon)
    a, b = complex(segment[0], segment[1]), complex(segment[2], segment[3])
    for _ in range(len(walls)):
        place, near = -1, math.inf
        for e in range(len(walls)):
            apart = apart_squared(a, b, complex(walls[e, 0], walls[e, 1]), complex(walls[e, 2], walls[e, 3]))
            if not done[e] and apart < near:
                place, near = e, apart
        done[place] = True
        if not in_reach(polygon, count, walls[place], radius):
            continue
        x, y, mine, others = between(segment, walls[place], radius)
        if x == 0.0 and y == 0.0:
            return -1
        # The wall stands still, so all of the margin is the robot's.
        rows[place, NORMAL_X], rows[place, NORMAL_Y] = x, y
        gap = math.sqrt(near)
        rows[place, OFFSET] = 0.5 * (mine + others) + 0.5 * gap - min(radius, gap)
        count = clip(polygon, count, rows[place], spare)
        for k in range(count):
            polygon[k, 0], polygon[k, 1] = spare[k, 0], spare[k, 1]
    return count


@kernel
def in_reach(polygon: Floats, count: int, wall: Floats, radius: float) -> bool:
    """Return whether a wall is nearer to a convex polygon than the radius, or in it.

    Args:
        polygon: (count or more, 2) corners, counter-clockwise, m.
        count: Number of corners.
        wall: (4,) x₁ y₁ x₂ y₂, m.
        radius: m.
    """
    a, b = complex(wall[0], wall[1]), complex(wall[2], wall[3])
    inside = True
    for k in range(count):
        after = k + 1 if k + 1 < count else 0
        c, d = complex(polygon[k, 0], polygon[k, 1]), complex(polygon[after, 0], polygon[after, 1])
        if apart_squared(a, b, c, d) < radius * radius:
            return True
        along, off = d - c, a - c
        if along.real * off.imag - along.imag * off.real < 0.0:
            inside = False
    return inside


@kernel
def surrounded(
    segments: Floats, hull: Floats, sides: Floats, walls: Floats, radii: tuple[float, float], rows: Floats
) -> tuple[Floats, Ints]:
    """Clip every robot's cell from the hull of the area, and fill in the half-planes of sides and walls.

    Args:
        segments: (n, 4) x₁ y₁ x₂ y₂ of each robot's stopping segment, m.
        hull: (c, 2) corners of a convex polygon that holds the area, counter-clockwise, m.
        sides: (h, 3) see `keep_within`.
        walls: (e, 4) see `keep_off`.
        radii: Distances of a centre from sides, and from walls (m).
        rows: (n, k + h + e, 3) half-planes, of which the first k are given.

    Returns:
        (n, c + k + h + e, 2) corners of each cell, counter-clockwise (m), and (n,) how many it has, −1 if the robot's
        segment meets a wall.
    """
    n, given = len(segments), rows.shape[1] - len(sides) - len(walls)
    most = len(hull) + rows.shape[1]
    corners, counts, spare = np.zeros((n, most, 2)), np.zeros(n, np.int64), np.empty((most, 2))
    for i in range(n):
        keep_within(segments[i], sides, radii[0], rows[i, given:])
        convex = given + len(sides)
        counts[i] = clip_all(hull, len(hull), rows[i, :convex], spare, corners[i])
        counts[i] = keep_off(segments[i], walls, radii[1], rows[i, convex:], corners[i], counts[i])
    return corners, counts
