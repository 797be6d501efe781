"""Robust overlays: union, intersection, difference and buffer of polygons that do not fail by rounding.

The exact operation comes first. Where the library raises an error, as for edges that cross next to a corner by
rounding, the operation is repeated with the corners of valid shapes rounded to the finest grid that works.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import shapely
    from shapely.geometry.base import BaseGeometry

GRIDS_M: Final = (1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3)
"""Grids that corners are rounded to, the finest first."""

Shapes = NDArray[np.object_]


def union(shapes: Iterable[BaseGeometry] | Shapes) -> BaseGeometry:
    """Union of any number of shapes; of none, an empty collection."""
    import shapely

    def united(parts: Sequence[BaseGeometry], grid_m: float | None) -> BaseGeometry:
        return shapely.union_all(parts, grid_size=grid_m)

    return _robust(united, list(shapes))


def union_of_two(first: BaseGeometry, second: BaseGeometry) -> BaseGeometry:
    """Union of two shapes; its rings may begin at other corners than those of `union`."""
    import shapely

    return _of_two(shapely.union, first, second)


def intersection(first: BaseGeometry, second: BaseGeometry) -> BaseGeometry:
    """Intersection of two shapes."""
    import shapely

    return _of_two(shapely.intersection, first, second)


def as_area(shape: BaseGeometry) -> shapely.Polygon | shapely.MultiPolygon:
    """Drop the lines and points of a shape, which come from touching polygons."""
    import shapely

    if isinstance(shape, shapely.Polygon | shapely.MultiPolygon):
        return shape
    return shapely.MultiPolygon([part for part in shapely.get_parts(shape) if isinstance(part, shapely.Polygon)])


def difference(first: BaseGeometry, second: BaseGeometry) -> BaseGeometry:
    """Part of the first shape that is outside the second."""
    import shapely

    return _of_two(shapely.difference, first, second)


def symmetric_difference(first: BaseGeometry, second: BaseGeometry) -> BaseGeometry:
    """Parts that belong to only one of two shapes."""
    import shapely

    return _of_two(shapely.symmetric_difference, first, second)


def intersections(first: Any, second: Any) -> Shapes:
    """Intersections of shapes in pairs, or of one shape with each of several.

    Args:
        first: A shape or (n,) shapes.
        second: A shape or (n,) shapes.

    Returns:
        (n,) intersections.
    """
    import shapely

    return _of_pairs(shapely.intersection, first, second)


def differences(first: Any, second: Any) -> Shapes:
    """Parts of the first shapes outside the second ones; arguments and result as of `intersections`."""
    import shapely

    return _of_pairs(shapely.difference, first, second)


def buffer(shape: BaseGeometry, distance_m: float, **style: Any) -> BaseGeometry:
    """Shape grown by a distance, or shrunk by a negative one; `style` and defaults as of a geometry's own `buffer`."""
    import shapely

    def grown(parts: Sequence[BaseGeometry], grid_m: float | None) -> BaseGeometry:
        (part,) = parts
        rounded = part if grid_m is None else shapely.set_precision(part, grid_m)
        found: BaseGeometry = rounded.buffer(distance_m, **style)
        return found

    return _robust(grown, [shape])


def _of_two(overlay: Callable[..., Any], *shapes: BaseGeometry) -> BaseGeometry:
    def applied(parts: Sequence[BaseGeometry], grid_m: float | None) -> BaseGeometry:
        found: BaseGeometry = overlay(*parts, grid_size=grid_m)
        return found

    return _robust(applied, shapes)


def _of_pairs(overlay: Callable[..., Any], first: Any, second: Any) -> Shapes:
    import shapely

    try:
        return np.asarray(overlay(first, second), dtype=object)
    except shapely.errors.GEOSException:
        pairs = np.broadcast_arrays(np.asarray(first, dtype=object), np.asarray(second, dtype=object))
        found = np.empty(len(pairs[0]), dtype=object)
        found[:] = [_of_two(overlay, *pair) for pair in zip(*pairs, strict=True)]
        return found


def _robust(
    operation: Callable[[Sequence[BaseGeometry], float | None], BaseGeometry], shapes: Sequence[BaseGeometry]
) -> BaseGeometry:
    """Run an operation exactly, else on the finest grid that works.

    Args:
        operation: Maps shapes and a grid (m; None: exact) to a shape.
        shapes: Arguments of the operation.
    """
    import shapely

    try:
        return operation(shapes, None)
    except shapely.errors.GEOSException:
        mended = [shape if shape.is_valid else shapely.make_valid(shape) for shape in shapes]
    for grid_m in GRIDS_M[:-1]:
        try:
            return operation(mended, grid_m)
        except shapely.errors.GEOSException:
            continue
    return operation(mended, GRIDS_M[-1])
