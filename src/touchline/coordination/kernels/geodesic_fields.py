"""Kernels: shortest ways on a grid from several places at once, at any angle.

Dijkstra's algorithm over 8 neighbours, in which a node keeps the place from which its way comes straight: its robot's,
or that of the last corner (Nash, Koenig, Tovey, "Lazy Theta*", AAAI 2010). Where a robot sees a node the distance is
exact; behind corners it is too long by a part of the grid's pitch.
"""

import heapq
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Complexes = NDArray[np.complex128]

_FAR_NODES = 1.5
"""Distance, in pitches, within which nodes are reached from a place itself."""


class FreeGrid(NamedTuple):
    """Grid of an area.

    Attributes:
        number: (rows, columns) number of each node; −1: not free.
        nodes: (n,) places, x + iy (m).
        rows: (n, 2) column and row of each.
        corner: Place of the node of column and row 0 (m).
        pitch_m: Distance of neighbours.
    """

    number: Ints
    nodes: Complexes
    rows: Ints
    corner: complex
    pitch_m: float


class GeodesicField(NamedTuple):
    """Ways to all nodes of a grid.

    Attributes:
        owners: (n,) number of the nearest place; −1: no way leads there.
        lengths_m: (n,) length of the way from there.
        leads: (n,) end of the way's first straight part, x + iy (m): the node itself, if it is seen.
        anchors: (n,) start of its last straight part.
        bases_m: (n,) length of the way to that.
    """

    owners: Ints
    lengths_m: Floats
    leads: Complexes
    anchors: Complexes
    bases_m: Floats


@kernel
def seen_on(grid: FreeGrid, place: complex, other: complex) -> bool:
    """Return whether all samples of the straight way between two places, half a pitch apart, are at free nodes."""
    way = other - place
    steps = math.ceil(2.0 * abs(way) / grid.pitch_m)
    for k in range(1, steps):
        at = (place + way * (k / steps) - grid.corner) / grid.pitch_m
        column, row = math.floor(at.real + 0.5), math.floor(at.imag + 0.5)
        if row < 0 or row >= grid.number.shape[0] or column < 0 or column >= grid.number.shape[1]:
            return False
        if grid.number[row, column] < 0:
            return False
    return True


@kernel
def fill_field(grid: FreeGrid, places: Complexes, field: GeodesicField) -> None:
    """Compute the ways from the nearest of some places to all nodes.

    Args:
        grid: The grid.
        places: (k,) of the grid's area, x + iy (m).
        field: Is filled.
    """
    n = len(grid.nodes)
    done = np.zeros(n, np.bool_)
    field.owners[:] = -1
    field.lengths_m[:] = math.inf
    heap = [(0.0, 0)]
    heap.pop()
    for who in range(len(places)):
        _sow(grid, places[who], who, field, heap)
    while len(heap) > 0:
        length, node = heapq.heappop(heap)
        if done[node] or length > field.lengths_m[node]:
            continue
        if not seen_on(grid, field.anchors[node], grid.nodes[node]):
            _bend(grid, node, done, field)
            heapq.heappush(heap, (field.lengths_m[node], node))
            continue
        done[node] = True
        _pass_on(grid, node, done, field, heap)


@kernel
def _sow(grid: FreeGrid, place: complex, who: int, field: GeodesicField, heap: list[tuple[float, int]]) -> None:
    """Reach the nodes beside a place."""
    for node in range(len(grid.nodes)):
        length = abs(grid.nodes[node] - place)
        if length > min(_FAR_NODES * grid.pitch_m, field.lengths_m[node]):
            continue
        if seen_on(grid, place, grid.nodes[node]):
            field.owners[node], field.lengths_m[node], field.leads[node] = who, length, grid.nodes[node]
            field.anchors[node], field.bases_m[node] = place, 0.0
            heapq.heappush(heap, (length, node))


@kernel
def _bend(grid: FreeGrid, node: int, done: NDArray[np.bool_], field: GeodesicField) -> None:
    """Reach a node that its anchor does not see: by a neighbour's anchor, or round the neighbour itself."""
    field.lengths_m[node] = math.inf
    column, row = grid.rows[node, 0], grid.rows[node, 1]
    for up in range(-1, 2):
        for right in range(-1, 2):
            other = _node_at(grid, column + right, row + up)
            if other < 0 or other == node or not done[other]:
                continue
            direct = field.bases_m[other] + abs(grid.nodes[node] - field.anchors[other])
            if direct < field.lengths_m[node] and seen_on(grid, field.anchors[other], grid.nodes[node]):
                _reach(grid, node, other, field, direct)
            length = field.lengths_m[other] + abs(grid.nodes[node] - grid.nodes[other])
            if length < field.lengths_m[node]:
                field.owners[node], field.lengths_m[node] = field.owners[other], length
                field.leads[node] = field.leads[other]
                field.anchors[node], field.bases_m[node] = grid.nodes[other], field.lengths_m[other]


@kernel
def _pass_on(
    grid: FreeGrid, node: int, done: NDArray[np.bool_], field: GeodesicField, heap: list[tuple[float, int]]
) -> None:
    """Reach the neighbours of a node, straight from its anchor."""
    column, row = grid.rows[node, 0], grid.rows[node, 1]
    for up in range(-1, 2):
        for right in range(-1, 2):
            other = _node_at(grid, column + right, row + up)
            if other < 0 or done[other]:
                continue
            length = field.bases_m[node] + abs(grid.nodes[other] - field.anchors[node])
            if length < field.lengths_m[other]:
                _reach(grid, other, node, field, length)
                heapq.heappush(heap, (length, other))


@kernel
def _reach(grid: FreeGrid, node: int, by: int, field: GeodesicField, length: float) -> None:
    """Let the way to a node come straight from the anchor of another."""
    field.owners[node], field.lengths_m[node] = field.owners[by], length
    field.anchors[node], field.bases_m[node] = field.anchors[by], field.bases_m[by]
    field.leads[node] = grid.nodes[node] if field.bases_m[by] == 0.0 else field.leads[by]


@kernel
def _node_at(grid: FreeGrid, column: int, row: int) -> int:
    """Return the number of the node of a column and row; −1: none, or it is not free."""
    if row < 0 or row >= grid.number.shape[0] or column < 0 or column >= grid.number.shape[1]:
        return -1
    return int(grid.number[row, column])
