"""Kernels: mass, first and second moment of convex polygons about a point, exact but for rounding.

The moments are four numbers: mass M = ∫φ, first moment ∫(q − p)φ, x and y, and second moment ∫|q − p|²φ.
"""

import math

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.kernels.clipping import clip_all
from touchline.core.jit import kernel

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
# Columns of moments.
MASS, FIRST_X, FIRST_Y, SECOND = range(4)


@kernel
def add_triangle(u: complex, v: complex, weight: float, found: Floats) -> None:
    """Add the moments about 0 of the triangle 0, u, v, negative if it is clockwise.

    Args:
        u: m.
        v: m.
        weight: φ.
        found: (4,) MASS to SECOND.
    """
    area = weight * 0.5 * (u.real * v.imag - u.imag * v.real)
    found[MASS] += area
    found[FIRST_X] += area * (u.real + v.real) / 3.0
    found[FIRST_Y] += area * (u.imag + v.imag) / 3.0
    squares = u.real * u.real + u.imag * u.imag + v.real * v.real + v.imag * v.imag
    found[SECOND] += area * (squares + u.real * v.real + u.imag * v.imag) / 6.0


@kernel
def add_sector(start: complex, end: complex, radius: float, weight: float, found: Floats) -> None:
    """Add the moments about 0 of the sector of a disc about 0 between two directions less than half a turn apart.

    Args:
        start: A point in the first direction.
        end: One in the second; the moments are negative if that lies clockwise of the first.
        radius: Radius of the disc (m).
        weight: φ.
        found: (4,) MASS to SECOND.
    """
    turn = math.atan2(start.real * end.imag - start.imag * end.real, start.real * end.real + start.imag * end.imag)
    u, v = start / abs(start), end / abs(end)
    square = radius * radius
    found[MASS] += weight * 0.5 * square * turn
    # ∫ of the unit vector over the angle is −i(v − u).
    found[FIRST_X] += weight * square * radius * (v.imag - u.imag) / 3.0
    found[FIRST_Y] -= weight * square * radius * (v.real - u.real) / 3.0
    found[SECOND] += weight * 0.25 * square * square * turn


@kernel
def add_in_disc(a: complex, b: complex, radius: float, weight: float, found: Floats) -> None:
    """Add the moments about 0 of the triangle 0, a, b, as far as it lies in a disc about 0.

    The edge is cut where it crosses the circle; between cuts the disc's part is a triangle or a sector.

    Args:
        a: m.
        b: m.
        radius: Radius of the disc (m).
        weight: φ.
        found: (4,) MASS to SECOND.
    """
    along = b - a
    square = along.real * along.real + along.imag * along.imag
    cross = a.real * b.imag - a.imag * b.real
    if square == 0.0 or cross == 0.0:
        return
    middle = -(a.real * along.real + a.imag * along.imag) / square
    half_square = radius * radius / square - (cross / square) * (cross / square)
    if half_square <= 0.0:
        add_sector(a, b, radius, weight, found)
        return
    half = math.sqrt(half_square)
    into, out = min(max(middle - half, 0.0), 1.0), min(max(middle + half, 0.0), 1.0)
    if out <= into:
        add_sector(a, b, radius, weight, found)
        return
    enter, leave = a + into * along, a + out * along
    if into > 0.0:
        add_sector(a, enter, radius, weight, found)
    add_triangle(enter, leave, weight, found)
    if out < 1.0:
        add_sector(leave, b, radius, weight, found)


@kernel
def shift(found: Floats, by: complex) -> None:
    """Convert moments about 0 to those about `by` (m): |q − d|² = |q|² − 2d·q + |d|²."""
    square = by.real * by.real + by.imag * by.imag
    found[SECOND] += found[MASS] * square - 2.0 * (by.real * found[FIRST_X] + by.imag * found[FIRST_Y])
    found[FIRST_X] -= found[MASS] * by.real
    found[FIRST_Y] -= found[MASS] * by.imag


@kernel
def add_polygon(corners: Floats, count: int, about: complex, weight: float, found: Floats) -> None:
    """Add the moments of a polygon of uniform density.

    Args:
        corners: (count or more, 2) counter-clockwise, m.
        count: Number of corners.
        about: p (m).
        weight: φ.
        found: (4,) MASS to SECOND.
    """
    for k in range(count):
        after = k + 1 if k + 1 < count else 0
        u, v = complex(corners[k, 0], corners[k, 1]), complex(corners[after, 0], corners[after, 1])
        add_triangle(u - about, v - about, weight, found)


@kernel
def even_moments(parts: Floats, counts: Ints, points: Floats, weight: float) -> Floats:
    """Return moments of cells, of uniform density, each about its own point.

    Args:
        parts: (n, p, m, 2) corners of each cell's convex parts, m.
        counts: (n, p) number of corners of each part.
        points: (n, 2) m.
        weight: φ.

    Returns:
        (n, 4) MASS to SECOND.
    """
    found = np.zeros((len(parts), 4))
    for i in range(len(parts)):
        for k in range(parts.shape[1]):
            add_polygon(parts[i, k], counts[i, k], complex(points[i, 0], points[i, 1]), weight, found[i])
    return found


@kernel
def disc_moments(parts: Floats, counts: Ints, points: Floats, discs: Floats) -> Floats:
    """Return moments of cells as far as they lie in discs, each about its own point.

    Args:
        parts: (n, p, m, 2) corners of each cell's convex parts, m.
        counts: (n, p) number of corners of each part.
        points: (n, 2) m.
        discs: (d, 4) x, y, radius (m) and φ.

    Returns:
        (n, 4) MASS to SECOND.
    """
    found, part = np.zeros((len(parts), 4)), np.empty(4)
    for i in range(len(parts)):
        for d in range(len(discs)):
            centre = complex(discs[d, 0], discs[d, 1])
            for column in range(4):
                part[column] = 0.0
            for k in range(parts.shape[1]):
                for c in range(counts[i, k]):
                    after = c + 1 if c + 1 < counts[i, k] else 0
                    a = complex(parts[i, k, c, 0], parts[i, k, c, 1]) - centre
                    b = complex(parts[i, k, after, 0], parts[i, k, after, 1]) - centre
                    add_in_disc(a, b, discs[d, 2], discs[d, 3], part)
            shift(part, complex(points[i, 0], points[i, 1]) - centre)
            for column in range(4):
                found[i, column] += part[column]
    return found


@kernel
def raster_moments(
    parts: Floats, counts: Ints, points: Floats, origin: complex, pixel: float, weights: Floats
) -> Floats:
    """Return moments of cells, with a density that is uniform over each square of a raster and 0 outside it.

    Args:
        parts: (n, p, m, 2) corners of each cell's convex parts, m.
        counts: (n, p) number of corners of each part.
        points: (n, 2) m.
        origin: The raster's corner of least x and y (m).
        pixel: Side of a square (m).
        weights: (rows, columns) φ, from the origin, rows along y.

    Returns:
        (n, 4) MASS to SECOND.
    """
    found = np.zeros((len(parts), 4))
    most = parts.shape[2] + 4
    square, clipped, spare = np.zeros((4, 3)), np.empty((most, 2)), np.empty((most, 2))
    for i in range(len(parts)):
        about = complex(points[i, 0], points[i, 1])
        for k in range(parts.shape[1]):
            low_x, high_x = _span(parts[i, k], counts[i, k], 0, origin.real / pixel, pixel, weights.shape[1])
            low_y, high_y = _span(parts[i, k], counts[i, k], 1, origin.imag / pixel, pixel, weights.shape[0])
            for cell in range((high_x - low_x) * (high_y - low_y)):
                row, column = low_y + cell // (high_x - low_x), low_x + cell % (high_x - low_x)
                if weights[row, column] != 0.0:
                    _square(origin + pixel * complex(column, row), pixel, square)
                    left = clip_all(parts[i, k], counts[i, k], square, spare, clipped)
                    add_polygon(clipped, left, about, weights[row, column], found[i])
    return found


@kernel
def _span(corners: Floats, count: int, axis: int, first: float, pixel: float, most: int) -> tuple[int, int]:
    """Return the first square that corners touch along an axis, and the one behind the last."""
    low, high = most, 0
    for k in range(count):
        at = math.floor(corners[k, axis] / pixel - first)
        low, high = min(low, at), max(high, at + 1)
    low = max(low, 0)
    return low, max(min(high, most), low)


@kernel
def _square(corner: complex, pixel: float, rows: Floats) -> None:
    """Fill in the four half-planes of a square; zeros stay."""
    rows[0, 0], rows[0, 2] = 1.0, corner.real + pixel
    rows[1, 0], rows[1, 2] = -1.0, -corner.real
    rows[2, 1], rows[2, 2] = 1.0, corner.imag + pixel
    rows[3, 1], rows[3, 2] = -1.0, -corner.imag
