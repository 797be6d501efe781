"""Shortest ways round walls, on a grid: the way from a place to a goal, and how far along it a robot can see.

Distances are by Dijkstra's algorithm over 16 neighbours, at most 2.8 % longer than the shortest way on the plane. The
area is shrunk by the distance that plans keep from walls, and a little more, so that they need not graze corners.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.free_area import FreeArea

if TYPE_CHECKING:
    from scipy.sparse import csr_array
    from shapely.geometry.base import BaseGeometry as Shape

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Complexes = NDArray[np.complex128]

PITCH_M: Final = 0.1
_ROOM_M: Final = 0.02
_GRAZED_M: Final = 1e-3
"""Distance beyond that of plans to which a straight way may graze a wall; a clear way keeps as much more than that."""
_NEAREST: Final = 16
_KEPT: Final = 256
"""Goals of which the ways are kept: those of some tasks move on with every update."""
_STEPS: Final = tuple((x, y) for x in range(-2, 3) for y in range(-2, 3) if math.gcd(x, y) == 1)


class Geodesics:
    """Ways within an area.

    Attributes:
        rows: (n, 2) column and row of each point of the grid.
        number: (rows, columns) number of each point; −1: not free.
        corner: Place of column and row 0, x + iy (m).
        pitch_m: Distance of neighbours.
    """

    def __init__(self, area: FreeArea, wall_m: float, pitch_m: float = PITCH_M) -> None:
        """Lay the grid.

        Args:
            area: The area.
            wall_m: Distance that plans keep from walls.
            pitch_m: Distance of neighbours on the grid.
        """
        import shapely

        room = area.shape.buffer(-(wall_m + _ROOM_M))
        self._sight = area.shape.buffer(-(wall_m - _GRAZED_M))
        self._clear = area.shape.buffer(-(wall_m + _GRAZED_M))
        shapely.prepare(self._sight)
        shapely.prepare(self._clear)
        low, high = area.hull.min(axis=0), area.hull.max(axis=0)
        self.corner, self.pitch_m = complex(*low), pitch_m
        across, up = (math.floor(n) + 1 for n in (high - low) / pitch_m)
        column, row = (grid.ravel() for grid in np.meshgrid(np.arange(across), np.arange(up)))
        at = low + pitch_m * np.column_stack((column, row))
        free = shapely.contains_xy(room, at)
        self._room, self._nodes = room, at[free]
        self.rows: Ints = np.column_stack((column, row))[free]
        number: Ints = np.full(across * up, -1, dtype=np.int64)
        number[free] = np.arange(int(free.sum()))
        self.number: Ints = number.reshape(up, across)
        self._fields: dict[int, tuple[Floats, Ints]] = {}

    @cached_property
    def _graph(self) -> csr_array:
        """Lengths (m) of the straight ways between neighbours that keep clear of walls."""
        import shapely
        from scipy.sparse import csr_array

        up, across = self.number.shape
        column, row = (grid.ravel() for grid in np.meshgrid(np.arange(across), np.arange(up)))
        edges = [_edges(self.number.ravel(), column, row, step, (across, up)) for step in _STEPS]
        starts, ends = (np.concatenate(side) for side in zip(*edges, strict=True))
        clear = shapely.covers(self._room, shapely.linestrings(np.stack((self._nodes[starts], self._nodes[ends]), 1)))
        starts, ends = starts[clear], ends[clear]
        lengths = np.hypot(*(self._nodes[starts] - self._nodes[ends]).T)
        return csr_array((lengths, (starts, ends)), shape=(len(self._nodes), len(self._nodes)))

    def way(self, place: complex, goal: complex) -> tuple[complex, float]:
        """Return the farthest point of the way to a goal that is seen from a place, and the length of the way.

        Args:
            place: x + iy (m).
            goal: x + iy (m).

        Returns:
            The goal itself if it is seen, or if there is no way; and metres.
        """
        if self.sees(place, goal):
            return goal, abs(goal - place)
        left_m, onward = self._field(goal)
        at, seen, length_m = self._nearest_seen(place), goal, abs(goal - place)
        while at >= 0 and self.sees(place, node := complex(*self._nodes[at])):
            seen, length_m, at = node, abs(node - place) + float(left_m[at]), int(onward[at])
        return (seen, length_m) if math.isfinite(length_m) else (goal, abs(goal - place))

    @property
    def nodes(self) -> Complexes:
        """(n,) points of the grid, x + iy (m)."""
        found: Complexes = self._nodes[:, 0] + 1j * self._nodes[:, 1]
        return found

    def nodes_to(self, place: complex, goal: complex) -> Complexes:
        """Return (k,) the points of the grid on the way from a place to a goal (m); none if there is no way."""
        left_m, onward = self._field(goal)
        at, found = self._nearest_seen(place), list[int]()
        while at >= 0 and math.isfinite(left_m[at]):
            found.append(at)
            at = int(onward[at])
        return self.nodes[found]

    def ways_between(self, places: Complexes, most_m: float) -> dict[tuple[int, int], Complexes]:
        """Return ways between places that are not longer than a length, there and back on the same points.

        Args:
            places: (n,) x + iy (m).
            most_m: The length.

        Returns:
            By the numbers of two places: (k,) points of the way from the first to the second (m).
        """
        from scipy.sparse.csgraph import dijkstra

        nearest = np.array([self._nearest_seen(place) for place in places.tolist()])
        lengths_m, onward = dijkstra(self._graph, indices=nearest, return_predecessors=True, limit=most_m)
        nodes, found = self.nodes, dict[tuple[int, int], Complexes]()
        for end, start in np.argwhere(np.isfinite(lengths_m[:, nearest])).tolist():
            if start < end:
                at, between = int(nearest[start]), list[int]()
                while at >= 0:
                    between.append(at)
                    at = int(onward[end, at])
                line = np.concatenate((places[[start]], nodes[between], places[[end]]))
                found[start, end], found[end, start] = line, line[::-1]
        return found

    def fields_m(self, goals: Sequence[complex]) -> Floats:
        """Return (k, nodes) the distance from each point of the grid to each of k goals (m); inf: there is no way."""
        from scipy.sparse.csgraph import dijkstra

        if not goals:
            return np.zeros((0, len(self._nodes)))
        found: Floats = dijkstra(self._graph, indices=self.nearest_nodes(np.array(goals)))
        return found

    def nearest_nodes(self, places: Complexes) -> Ints:
        """Return (n,) the numbers of the points of the grid that are nearest to places (n,) (m)."""
        return np.array([int(self._off(place).argmin()) for place in places.tolist()], dtype=np.int64)

    def _field(self, goal: complex) -> tuple[Floats, Ints]:
        """Return (nodes,) the distance from each to a goal (m), and the next node on the way; negative: none."""
        from scipy.sparse.csgraph import dijkstra

        end = int(self._off(goal).argmin())
        if end not in self._fields:
            if len(self._fields) >= _KEPT:
                del self._fields[next(iter(self._fields))]
            left_m, onward = dijkstra(self._graph, indices=np.array([end]), return_predecessors=True)
            self._fields[end] = left_m[0], onward[0].astype(np.int64)
        return self._fields[end]

    def _nearest_seen(self, place: complex) -> int:
        """Return the nearest node that is seen from a place, or the nearest of all."""
        nearest = self._off(place).argsort()[:_NEAREST].tolist()
        return int(next((node for node in nearest if self.sees(place, complex(*self._nodes[node]))), nearest[0]))

    def _off(self, place: complex) -> Floats:
        """Return (nodes,) the distance of each node from a place (m)."""
        found: Floats = np.hypot(self._nodes[:, 0] - place.real, self._nodes[:, 1] - place.imag)
        return found

    def sees(self, place: complex, other: complex) -> bool:
        """Return whether the straight way between two places (m) keeps off walls."""
        return _holds(self._sight, place, other)

    def clear(self, place: complex, other: complex) -> bool:
        """Return whether it keeps so far off walls that a plan along it is permitted."""
        return _holds(self._clear, place, other)


def _holds(shape: Shape, place: complex, other: complex) -> bool:
    """Return whether the straight way between two places (m) lies in an area."""
    import shapely

    return bool(shape.covers(shapely.LineString(((place.real, place.imag), (other.real, other.imag)))))


def _edges(number: Ints, column: Ints, row: Ints, step: tuple[int, int], size: tuple[int, int]) -> tuple[Ints, Ints]:
    """Return the nodes between which a step of the grid leads."""
    to_column, to_row = column + step[0], row + step[1]
    within = (to_column >= 0) & (to_column < size[0]) & (to_row >= 0) & (to_row < size[1])
    starts, ends = number[within], number[to_row[within] * size[0] + to_column[within]]
    there = (starts >= 0) & (ends >= 0)
    return starts[there], ends[there]
