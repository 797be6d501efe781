"""Distances to outlines: polygons and points of the scenario, as arrays for kernels."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.jit import kernel

# Columns of a table of places.
FIRST: Final = 0  # vertex
COUNT: Final = 1
CENTRE_X: Final = 2  # mean of the vertices
CENTRE_Y: Final = 3
VALUE_1: Final = 4  # the caller's
VALUE_2: Final = 5
VALUE_3: Final = 6
COLUMNS: Final = 7

Floats = NDArray[np.float64]


class Zones(NamedTuple):
    """Places of one kind."""

    places: Floats
    """(n, COLUMNS)."""
    vertices: Floats
    """(m, 2) of all their outlines, map frame [m]."""


def make_zones(places: Iterable[tuple[Sequence[tuple[float, float]], tuple[float, float, float]]]) -> Zones:
    """From (outline, values) pairs."""
    rows: list[list[float]] = []
    vertices: list[tuple[float, float]] = []
    for outline, values in places:
        count = len(outline)
        centre = (math.fsum(x for x, _ in outline) / count, math.fsum(y for _, y in outline) / count)
        rows.append([len(vertices), count, *centre, *values])
        vertices += outline
    return Zones(
        np.array(rows, dtype=np.float64).reshape(-1, COLUMNS),
        np.array(vertices, dtype=np.float64).reshape(-1, 2),
    )


@kernel
def distance(place: Floats, vertices: Floats, x: float, y: float) -> float:
    """Distance of (x, y) from the outline of `place` [m]; 0 inside of it.

    Whether it is inside: by the crossings of a ray to the east with the outline (even-odd rule).

    Args:
        place: (COLUMNS,) row of `Zones.places`.
        vertices: (m, 2) of `Zones`, map frame [m].
        x: East, map frame [m].
        y: North, map frame [m].
    """
    first, count = int(place[FIRST]), int(place[COUNT])
    inside = False
    nearest = math.inf
    bx, by = vertices[first + count - 1, 0], vertices[first + count - 1, 1]
    for index in range(first, first + count):
        ax, ay = bx, by
        bx, by = vertices[index, 0], vertices[index, 1]
        if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
            inside = not inside
        dx, dy = bx - ax, by - ay
        length2 = dx * dx + dy * dy
        along = ((x - ax) * dx + (y - ay) * dy) / length2 if length2 > 0.0 else 0.0
        along = min(max(along, 0.0), 1.0)
        nearest = min(nearest, math.hypot(ax + along * dx - x, ay + along * dy - y))
    return 0.0 if inside else nearest
