"""Reachable ground of a machine's tool while its body stays on free ground: polygons, heading by heading."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.robust_overlay import as_area, buffer, difference, intersection, union, union_of_two

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

HEADINGS: Final = 72
"""Every 5°."""
_GROUNDS: Final = 4
"""Size of the cache: areas of one template lie on the same ground, and are planned again."""

Floats = NDArray[np.float64]
Point = tuple[float, float]


def reachable(
    ground: BaseGeometry,
    free: BaseGeometry,
    outline: Sequence[Point],
    tool: Point,
    width_m: float,
    home: BaseGeometry | None = None,
) -> BaseGeometry:
    """Part of the ground that the tool can pass over at some heading, regardless of paths to it.

    Args:
        ground: Ground to pass over (m, map frame).
        free: Ground where the body may be.
        outline: Corners of the body, in its own frame (m).
        tool: Middle of the tool in that frame; it lies across the body.
        width_m: Width of the tool.
        home: Region in which the body's origin stays; None: anywhere.
    """
    return intersection(ground, _within_reach(free, tuple(outline), tool, width_m, home))


@lru_cache(maxsize=_GROUNDS)
def _within_reach(
    free: BaseGeometry, outline: tuple[Point, ...], tool: Point, width_m: float, home: BaseGeometry | None
) -> BaseGeometry:
    """Ground that the tool can pass over."""
    parts = []
    for heading in headings_rad():
        at = _places(free, outline, heading)
        at = at if home is None else as_area(intersection(at, home))
        parts.append(_tool_over(at, heading, tool, 0.5 * width_m))
    return union(parts)


def headings_rad() -> list[float]:
    """Sampled headings (rad)."""
    return [number * math.tau / HEADINGS for number in range(HEADINGS)]


def free_ground(boundary: BaseGeometry, kept_out: Sequence[BaseGeometry], margin_m: float = 0.0) -> BaseGeometry:
    """Ground inside a boundary and off kept-out shapes, by a margin; corners stay corners.

    Args:
        boundary: Boundary (m, map frame).
        kept_out: Shapes to keep off (m, map frame).
        margin_m: Minimum clearance.
    """
    if margin_m:
        boundary = buffer(boundary, -margin_m, join_style="mitre")
        kept_out = [buffer(each, margin_m, join_style="mitre", mitre_limit=2.0) for each in kept_out]
    return difference(boundary, union(kept_out))


def places(free: BaseGeometry, outline: Sequence[Point], heading_rad: float) -> BaseGeometry:
    """Positions of a body's origin, which lies inside it, at a heading with the whole body on free ground.

    Args:
        free: Free ground (m, map frame).
        outline: Corners of the body, in its own frame (m).
        heading_rad: Heading of the body, from +x of the map frame.
    """
    return _places(free, tuple(outline), heading_rad)


@lru_cache(maxsize=_GROUNDS * HEADINGS)
def _places(free: BaseGeometry, outline: tuple[Point, ...], heading_rad: float) -> BaseGeometry:
    import shapely

    rings = [ring for part in shapely.get_parts(free) for ring in (part.exterior, *part.interiors)]
    if not rings:
        return free
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(shapely.Polygon(outline)))
    mirrored = -_turned(np.array([shapely.get_coordinates(triangle)[:3] for triangle in triangles]), heading_rad)
    corners = [shapely.get_coordinates(ring) for ring in rings]
    walls = np.concatenate([np.stack((ring[:-1], ring[1:]), axis=1) for ring in corners])
    sums = (walls[:, None, :, None] + mirrored[None, :, None]).reshape(-1, 6, 2)
    hit = np.asarray(shapely.convex_hull(shapely.linestrings(sums)))
    return difference(free, union(hit))


def _tool_over(at: BaseGeometry, heading_rad: float, tool: Point, half_width_m: float) -> BaseGeometry:
    """Ground under the tool while the body's origin is at given positions."""
    import shapely

    ends = _turned(np.array([[tool[0], tool[1] - half_width_m], [tool[0], tool[1] + half_width_m]]), heading_rad)
    rings = [ring for part in shapely.get_parts(at) for ring in (part.exterior, *part.interiors)]
    if not rings:
        return at
    corners = [shapely.get_coordinates(ring) for ring in rings]
    walls = np.concatenate([np.stack((ring[:-1], ring[1:]), axis=1) for ring in corners])
    edges = np.asarray(shapely.convex_hull(shapely.linestrings((walls[:, :, None] + ends).reshape(-1, 4, 2))))
    middle = shapely.transform(at, lambda points: points + ends.mean(axis=0))
    return union_of_two(middle, union(edges))


def _turned(points: Floats, heading_rad: float) -> Floats:
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    return np.asarray(points @ np.array([[cos, sin], [-sin, cos]]))
