"""Points, segments and closed outlines in kernels; points are complex numbers x + iy (m)."""

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel


@kernel
def crossed(point: complex, a: complex, b: complex) -> bool:
    """True if a ray from the point along +x crosses the edge from `a` to `b`, the lower end included.

    A point is inside a closed outline if its ray crosses an odd number of edges: Shimrat, "Algorithm 112: position of
    point relative to polygon", Communications of the ACM 5(8), 1962.

    Args:
        point: Origin of the ray, m.
        a: One end of the edge, m.
        b: The other end.
    """
    x, y = point.real, point.imag
    return (a.imag > y) != (b.imag > y) and x < a.real + (y - a.imag) / (b.imag - a.imag) * (b.real - a.real)


@kernel
def within(point: complex, edges: NDArray[np.float64]) -> bool:
    """True if a point is inside a closed outline, by the rule of `crossed`.

    Args:
        point: Point, m.
        edges: (n, 4) x₁ y₁ x₂ y₂ of each edge, in any order, m.
    """
    inside = False
    for e in range(len(edges)):
        if crossed(point, complex(edges[e, 0], edges[e, 1]), complex(edges[e, 2], edges[e, 3])):
            inside = not inside
    return inside


@kernel
def nearest_share(point: complex, a: complex, b: complex) -> float:
    """Parameter of the point of a segment that is nearest to another point: 0 at its first end, 1 at its second.

    Args:
        point: Point, m.
        a: One end of the segment, m.
        b: The other end; it may be the same.
    """
    u, from_a = b - a, point - a
    square = u.real * u.real + u.imag * u.imag
    share = (from_a.real * u.real + from_a.imag * u.imag) / square if square > 0.0 else 0.0
    return min(max(share, 0.0), 1.0)


@kernel
def crossing_share(a: complex, b: complex, c: complex, d: complex) -> float:
    """Parameter, 0 to 1, at which the first segment is crossed by the second; −1 if they do not cross, or are parallel.

    Args:
        a: One end of the first segment, m.
        b: Its other end.
        c: One end of the second, m.
        d: Its other end.
    """
    u, v, w = b - a, d - c, c - a
    cross = u.real * v.imag - u.imag * v.real
    if cross == 0.0:
        return -1.0
    s, t = (w.real * v.imag - w.imag * v.real) / cross, (w.real * u.imag - w.imag * u.real) / cross
    return float(s) if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0 else -1.0


@kernel
def off_squared(point: complex, a: complex, b: complex) -> float:
    """Squared distance (m²) of a point from a segment.

    Args:
        point: Point, m.
        a: One end of the segment, m.
        b: The other end; it may be the same.
    """
    u, from_a = b - a, point - a
    share = nearest_share(point, a, b)
    x, y = from_a.real - share * u.real, from_a.imag - share * u.imag
    return float(x * x + y * y)


@kernel
def apart_squared(a: complex, b: complex, c: complex, d: complex) -> float:
    """Squared distance (m²) between two segments; 0 if they meet.

    Segments that do not cross are nearest to each other at an end of one of them.

    Args:
        a: One end of the first segment, m.
        b: Its other end.
        c: One end of the second, m.
        d: Its other end.
    """
    if crossing_share(a, b, c, d) >= 0.0:
        return 0.0
    least = min(off_squared(a, c, d), off_squared(b, c, d))
    return float(min(least, off_squared(c, a, b), off_squared(d, a, b)))
