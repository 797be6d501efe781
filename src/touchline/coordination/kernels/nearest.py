"""Kernels: nearest points of two segments, or of a polygon to a point; points are x + iy (m)."""

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.polygons import crossing_share, nearest_share

Floats = NDArray[np.float64]


@kernel
def nearest_on(point: complex, a: complex, b: complex) -> complex:
    """Return the point of a segment nearest to another point.

    Args:
        point: m.
        a: One end of the segment, m.
        b: The other; it may be the same.
    """
    share = nearest_share(point, a, b)
    return b if share == 1.0 else a + share * (b - a)


@kernel
def nearest_pair(a: complex, b: complex, c: complex, d: complex) -> tuple[complex, complex]:
    """Return the nearest points of two segments.

    Segments that do not cross are nearest at an end of one of them, so four ends are tried, in the order a, b, c, d; of
    equals the first is taken. Parallel segments side by side are equally near along a stretch, but all the normals are
    the same there, and so is the line half-way between. A segment may be a single point.

    Args:
        a: One end of the first segment, m.
        b: Its other end.
        c: One end of the second, m.
        d: Its other end.

    Returns:
        A point of the first and one of the second; the same point twice if they meet.
    """
    share = crossing_share(a, b, c, d)
    if share >= 0.0:
        return a + share * (b - a), a + share * (b - a)
    best, pair = np.inf, (a, c)
    for k in range(4):
        if k < 2:
            first = a if k == 0 else b
            second = nearest_on(first, c, d)
        else:
            second = c if k == 2 else d
            first = nearest_on(second, a, b)
        apart = abs(second - first)
        if apart < best:
            best, pair = apart, (first, second)
    return pair


@kernel
def nearest_in(corners: Floats, count: int, point: complex) -> complex:
    """Return the point of a convex polygon nearest to another point: that itself, if it is inside.

    Args:
        corners: (count or more, 2) counter-clockwise, m; later rows are ignored.
        count: Number of corners; at least 1.
        point: m.
    """
    inside, best = count > 2, np.inf
    found = complex(corners[0, 0], corners[0, 1])
    for k in range(count):
        after = k + 1 if k + 1 < count else 0
        a, b = complex(corners[k, 0], corners[k, 1]), complex(corners[after, 0], corners[after, 1])
        along, off = b - a, point - a
        if along.real * off.imag - along.imag * off.real < 0.0:
            inside = False
        near = nearest_on(point, a, b)
        apart = abs(point - near)
        if apart < best:
            best, found = apart, near
    return point if inside else found
