"""Passages of an area: stretches narrower than a width, with room at both ends, found on its medial axis.

The medial axis is taken from the Voronoi diagram of points on the border: its ridges between points that face each
other across the free space. Ridges along which the space is narrow, but wide enough for a robot, form stretches, which
meet at forks. A stretch whose two ends are both in a room is a *passage*, one with an end in a room leads to a dead
end. Others are parts of a maze.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.free_area import FreeArea

if TYPE_CHECKING:
    from scipy.sparse import csr_array
    from shapely.geometry.base import BaseGeometry

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Complexes = NDArray[np.complex128]

NARROW_M: Final = 3.4
"""Width from which on a stretch is no passage."""
_ROOM_M: Final = 1.8
"""Width of a room."""
_SAMPLED_M: Final = 0.05
_FACING: Final = 2.0 * math.sin(math.radians(55.0))
"""Least distance of the points on both sides of the axis, over their distance from it: seen at 110° or more."""
_AS_NARROW: Final = 1.1
"""Clearance, over the least one, up to which a place belongs to the inside of a passage."""
_STEP_M: Final = 0.1
_SMOOTHED: Final = 5
_INTO_ROOM_M: Final = 0.05
_ENDS: Final = [0, -1]


@dataclass(frozen=True)
class Passage:
    """Passage.

    Attributes:
        line: (k,) its middle line from mouth to mouth, x + iy (m).
        width_m: Its least width.
    """

    line: Complexes
    width_m: float


def find_passages(area: FreeArea, least_m: float) -> tuple[list[Passage], float]:
    """Find the passages of an area.

    Args:
        area: The area.
        least_m: Width that robots need.

    Returns:
        The passages, and the least width of all other narrow stretches (m): 0 if they fork or lead from one to
        another, inf if there are none.
    """
    points, graph = _narrow_axis(area, least_m)
    rooms = area.shape.buffer(-0.5 * _ROOM_M).buffer(0.5 * _ROOM_M + _INTO_ROOM_M)
    found, others_m = list[Passage](), math.inf
    for nodes in _stretches(graph):
        line = _as_line(nodes, graph)
        if line is None or not (in_rooms := _in_rooms(points[line], rooms)):
            return found, 0.0
        passage = _passage(points[line], area)
        if in_rooms == len(_ENDS):
            found.append(passage)
        else:
            others_m = min(others_m, passage.width_m)
    return found, others_m


def _narrow_axis(area: FreeArea, least_m: float) -> tuple[Complexes, csr_array]:
    """Return points of the medial axis (n,), and a graph of its ridges along which the area is narrow."""
    import shapely
    from scipy.sparse import csr_array
    from scipy.spatial import Voronoi

    border = np.unique(shapely.get_coordinates(area.shape.segmentize(_SAMPLED_M).boundary), axis=0)
    diagram = Voronoi(border)
    at, ends = diagram.vertices, np.array(diagram.ridge_vertices, dtype=np.int64)
    bounded = (ends >= 0).all(axis=1)
    ends, sides = ends[bounded], border[diagram.ridge_points[bounded]]
    across_m = np.hypot(*(sides[:, 0] - sides[:, 1]).T)
    clear_m = np.hypot(*(at[ends] - sides[:, :1]).transpose(2, 0, 1))
    narrow = (clear_m.min(axis=1) >= 0.5 * least_m) & (clear_m.max(axis=1) < 0.5 * NARROW_M)
    narrow &= across_m >= _FACING * clear_m.max(axis=1)
    kept = ends[narrow]
    kept = kept[shapely.contains_xy(area.shape, *at[kept].transpose(2, 0, 1)).all(axis=1)]
    both = np.concatenate((kept, kept[:, ::-1]))
    ones = np.ones(len(both))
    return at[:, 0] + 1j * at[:, 1], csr_array((ones, (both[:, 0], both[:, 1])), shape=(len(at), len(at)))


def _stretches(graph: csr_array) -> list[Ints]:
    """Return the nodes of each connected part of a graph that has more than one."""
    from scipy.sparse.csgraph import connected_components

    _, part = connected_components(graph, directed=False)
    order = np.argsort(part, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(part[order])) + 1)
    return [nodes for nodes in parts if len(nodes) > 1]


def _as_line(nodes: Ints, graph: csr_array) -> Ints | None:
    """Return the nodes of a stretch from end to end; None if it forks or closes."""
    degrees = np.diff(graph.indptr)
    ends = nodes[degrees[nodes] == 1]
    if len(ends) != 2 or degrees[nodes].max() > 2:
        return None
    line, before = [int(ends[0])], -1
    while len(line) < len(nodes):
        onward = graph.indices[graph.indptr[line[-1]] : graph.indptr[line[-1] + 1]]
        before, after = line[-1], next(int(node) for node in onward if node != before)
        line.append(after)
    return np.array(line)


def _in_rooms(points: Complexes, rooms: BaseGeometry) -> int:
    """Return how many ends of a line are in rooms."""
    import shapely

    ends = points[_ENDS]
    return int(np.count_nonzero(shapely.contains_xy(rooms, ends.real, ends.imag)))


def _passage(points: Complexes, area: FreeArea) -> Passage:
    """Return the passage along a stretch of the axis."""
    import shapely

    points = _resampled(points)
    clear_m = shapely.distance(area.shape.boundary, shapely.points(points.real, points.imag))
    inside = np.flatnonzero(clear_m <= _AS_NARROW * clear_m.min())
    first, last = max(int(inside[0]) - 1, 0), min(int(inside[-1]) + 1, len(points) - 1)
    return Passage(points[first : last + 1], 2.0 * float(clear_m.min()))


def _resampled(points: Complexes) -> Complexes:
    """Return points at even steps along a line, smoothed."""
    along = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(points)))))
    steps = max(math.ceil(along[-1] / _STEP_M), 1)
    at = np.linspace(0.0, along[-1], steps + 1)
    even: Complexes = np.interp(at, along, points.real) + 1j * np.interp(at, along, points.imag)
    for _ in range(_SMOOTHED):
        even[1:-1] = 0.25 * even[:-2] + 0.5 * even[1:-1] + 0.25 * even[2:]
    return even
