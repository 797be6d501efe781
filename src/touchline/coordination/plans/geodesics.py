"""Shortest ways round walls, on a grid: the way from a place to a goal, and how far along it a robot can see.

Distances are by Dijkstra's algorithm over 16 neighbours, at most 2.8 % longer than the shortest way on the plane. The
area is shrunk by the distance that plans keep from walls, and a little more, so that they need not graze corners.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.free_area import FreeArea

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_PITCH_M: Final = 0.1
_ROOM_M: Final = 0.02
_GRAZED_M: Final = 1e-3
"""Distance beyond that of plans to which a straight way may graze a wall."""
_NEAREST: Final = 16
_STEPS: Final = tuple((x, y) for x in range(-2, 3) for y in range(-2, 3) if math.gcd(x, y) == 1)


class Geodesics:
    """Ways within an area.

    Args:
        area: The area.
        wall_m: Distance that plans keep from walls.
    """

    def __init__(self, area: FreeArea, wall_m: float) -> None:
        import shapely
        from scipy.sparse import csr_array

        room = area.shape.buffer(-(wall_m + _ROOM_M))
        self._sight = area.shape.buffer(-(wall_m - _GRAZED_M))
        shapely.prepare(self._sight)
        low, high = area.hull.min(axis=0), area.hull.max(axis=0)
        across, up = (math.floor(n) + 1 for n in (high - low) / _PITCH_M)
        column, row = (grid.ravel() for grid in np.meshgrid(np.arange(across), np.arange(up)))
        at = low + _PITCH_M * np.column_stack((column, row))
        free = shapely.contains_xy(room, at)
        self._nodes: Floats = at[free]
        number: Ints = np.full(across * up, -1, dtype=np.int64)
        number[free] = np.arange(int(free.sum()))
        edges = [_edges(number, column, row, step, (across, up)) for step in _STEPS]
        starts, ends = (np.concatenate(side) for side in zip(*edges, strict=True))
        clear = shapely.covers(room, shapely.linestrings(np.stack((self._nodes[starts], self._nodes[ends]), 1)))
        starts, ends = starts[clear], ends[clear]
        lengths = np.hypot(*(self._nodes[starts] - self._nodes[ends]).T)
        self._graph = csr_array((lengths, (starts, ends)), shape=(len(self._nodes), len(self._nodes)))
        self._fields: dict[complex, tuple[Floats, Ints]] = {}

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

    def _field(self, goal: complex) -> tuple[Floats, Ints]:
        """Return (nodes,) the distance from each to a goal (m), and the next node on the way; negative: none."""
        from scipy.sparse.csgraph import dijkstra

        if goal not in self._fields:
            ends = np.array([self._off(goal).argmin()])
            left_m, onward = dijkstra(self._graph, indices=ends, return_predecessors=True)
            self._fields[goal] = left_m[0], onward[0].astype(np.int64)
        return self._fields[goal]

    def _nearest_seen(self, place: complex) -> int:
        """Return the nearest node that is seen from a place; −1: none."""
        nearest = self._off(place).argsort()[:_NEAREST]
        return next((int(node) for node in nearest if self.sees(place, complex(*self._nodes[node]))), -1)

    def _off(self, place: complex) -> Floats:
        """Return (nodes,) the distance of each node from a place (m)."""
        found: Floats = np.hypot(self._nodes[:, 0] - place.real, self._nodes[:, 1] - place.imag)
        return found

    def sees(self, place: complex, other: complex) -> bool:
        """Return whether the straight way between two places keeps off walls."""
        import shapely

        return bool(self._sight.covers(shapely.LineString(((place.real, place.imag), (other.real, other.imag)))))


def _edges(number: Ints, column: Ints, row: Ints, step: tuple[int, int], size: tuple[int, int]) -> tuple[Ints, Ints]:
    """Return the nodes between which a step of the grid leads."""
    to_column, to_row = column + step[0], row + step[1]
    within = (to_column >= 0) & (to_column < size[0]) & (to_row >= 0) & (to_row < size[1])
    starts, ends = number[within], number[to_row[within] * size[0] + to_column[within]]
    there = (starts >= 0) & (ends >= 0)
    return starts[there], ends[there]
