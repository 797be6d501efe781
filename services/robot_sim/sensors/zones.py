"""Places of a scenario, polygons and points, as records for kernels, and the distance from them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.core.records import Record

Floats = NDArray[np.float64]


class PlaceOutline(Record):
    """Outline of a place: its vertices among those of its `Zones`, and their mean."""

    first: int
    """Index of its first vertex."""
    count: int
    """Number of its vertices."""
    centre_x_m: float
    centre_y_m: float


class Zones(NamedTuple):
    """Places of one kind."""

    places: Sequence[Any]
    """(n,) records of the kind, whose first field is the outline."""
    vertices: Floats
    """(m, 2) vertices of all outlines, map frame [m]."""


def make_zones(kind: type[Record], places: Iterable[tuple[Sequence[tuple[float, float]], tuple[float, ...]]]) -> Zones:
    """Make the places of a kind.

    Args:
        kind: Record with a `PlaceOutline`, and numbers after it.
        places: Outline of each place, its vertices in the map frame [m], and those numbers in their order.
    """
    rows: list[tuple[Any, ...]] = []
    vertices: list[tuple[float, float]] = []
    for outline, values in places:
        count = len(outline)
        centre = (math.fsum(x for x, _ in outline) / count, math.fsum(y for _, y in outline) / count)
        rows.append(((len(vertices), count, *centre), *values))
        vertices += outline
    made = np.array(rows, dtype=kind.dtype)
    return Zones(cast("Sequence[Any]", made), np.array(vertices, dtype=np.float64).reshape(-1, 2))


@kernel
def distance(outline: PlaceOutline, vertices: Floats, x: float, y: float) -> float:
    """Return the distance of a point from an outline [m]; 0 inside of it.

    A point is inside if a ray from it to the east crosses the outline an odd number of times (even-odd rule).

    Args:
        outline: Outline of a place of `Zones`.
        vertices: (m, 2) vertices of `Zones`, map frame [m].
        x: East, map frame [m].
        y: North, map frame [m].
    """
    first, count = outline.first, outline.count
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
