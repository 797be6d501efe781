"""Distances to outlines: polygons and points of the scenario, as records for kernels."""

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
    """Of a place: which vertices of its `Zones` it has, and their mean."""

    first: int
    count: int
    centre_x_m: float
    centre_y_m: float


class SteelPlace(Record):
    """Something magnetic."""

    outline: PlaceOutline
    field_t: float
    """At its outline."""
    reach_m: float
    """Over which that falls."""


class SkyPlace(Record):
    """Something that hides the sky."""

    outline: PlaceOutline
    best_fix: float
    """Inside of it, as of `receiver`."""
    margin_m: float
    """Around it, in which noise grows by up to:"""
    noise_factor: float


class Zones(NamedTuple):
    """Places of one kind."""

    places: Sequence[Any]
    """(n,) structured array of the kind's records."""
    vertices: Floats
    """(m, 2) of all their outlines, map frame [m]."""


def make_zones(kind: type[Record], places: Iterable[tuple[Sequence[tuple[float, float]], tuple[float, ...]]]) -> Zones:
    """Places of a kind, from (outline, values) pairs, the values in the kind's order."""
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
    """Distance of (x, y) from an outline [m]; 0 inside of it.

    Whether it is inside: by the crossings of a ray to the east with the outline (even-odd rule).

    Args:
        outline: Of a place of `Zones`.
        vertices: (m, 2) of `Zones`, map frame [m].
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
