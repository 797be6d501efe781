"""Map of moves for robots that go one after another: places to stand, moves between them, which exclude each other."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.geodesics import Geodesics
from touchline.coordination.plans.next_legs import line_of

if TYPE_CHECKING:
    from scipy.sparse import csr_array
    from shapely import LineString

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Complexes = NDArray[np.complex128]

CLEARER_M: Final = 0.05
"""Distance beyond that of plans that a move keeps from others, who are not quite where they should be."""
_PLACES_APART_M: Final = 0.1
"""Distance beyond that of plans from place to place."""
_LONGEST: Final = 2.1
"""Length of the longest move, over the distance of places: every place has neighbours within it."""
_DETOUR: Final = 1.15
"""A move is left out if two others lead there on a way no longer than its own times this."""
_LATTICE: Final = 5
"""Places are on every fifth point of the grid first, so that they stand in rows; then wherever there is room."""


@dataclass(frozen=True)
class MoveMap:
    """Places where robots may stand, and moves between them, n and e of them.

    Attributes:
        places: (n,) x + iy (m); the first are those asked for.
        starts: (e,) place at which each move begins.
        ends: (e,) place to which it leads.
        lengths_m: (e,)
        lines: Way of each move.
        closed: (e, n) places on which no other robot may stand during a move.
        moves_from: Moves that begin at each place.
    """

    places: Complexes
    starts: Ints
    ends: Ints
    lengths_m: Floats
    lines: list[LineString]
    closed: Bools
    moves_from: list[list[int]]

    def graph(self, taken: Collection[int]) -> csr_array:
        """Return the graph (n, n) of moves that can be made while robots stand at some places, by length (m)."""
        from scipy.sparse import csr_array

        standing = np.array(sorted(taken), dtype=np.int64)
        kept = ~(self.closed[:, standing].any(axis=1) | np.isin(self.starts, standing))
        size = len(self.places)
        return csr_array((self.lengths_m[kept], (self.starts[kept], self.ends[kept])), shape=(size, size))


def move_map_of(geodesics: Geodesics, asked: Complexes, apart_m: float) -> MoveMap:
    """Lay a roadmap.

    Args:
        geodesics: Ways within the area.
        asked: Places that it must have, x + iy (m).
        apart_m: Least distance of two robots.
    """
    import shapely

    places = _packed(asked, geodesics, apart_m + _PLACES_APART_M)
    ways = geodesics.ways_between(places, _LONGEST * (apart_m + _PLACES_APART_M))
    pairs = _direct(ways, len(places), 0.5 * apart_m)
    lines = [line_of(ways[pair]) for pair in pairs]
    starts, ends = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    points = shapely.points(places.real, places.imag)
    off_m = np.array([shapely.distance(line, points) for line in lines]).reshape(len(lines), len(places))
    leaves = np.abs(places[starts][:, None] - places) <= off_m + 1e-6
    moves_from = [np.flatnonzero(starts == place).tolist() for place in range(len(places))]
    lengths_m = np.array([line.length for line in lines])
    closed = (off_m < apart_m + CLEARER_M) & ~leaves
    return MoveMap(places, starts, ends, lengths_m, lines, closed, moves_from)


def _packed(asked: Complexes, geodesics: Geodesics, apart_m: float) -> Complexes:
    """Return places asked for, and as many others as there is room for."""
    nodes, rows = geodesics.nodes, geodesics.rows
    even = (rows % _LATTICE == 0).all(axis=1)
    left = np.concatenate((nodes[even], nodes[~even]))
    found = asked.tolist()
    for place in found:
        left = left[np.abs(left - place) >= apart_m]
    while len(left):
        found.append(complex(left[0]))
        left = left[np.abs(left - left[0]) >= apart_m]
    return np.array(found, dtype=np.complex128)


def _direct(ways: dict[tuple[int, int], Complexes], size: int, apart_m: float) -> list[tuple[int, int]]:
    """Return the pairs of places whose way does not lead past a third one, that is farther off than a distance."""
    lengths_m = np.full((size, size), np.inf)
    for pair, way in ways.items():
        lengths_m[pair] = np.abs(np.diff(way)).sum()
    steps_m = np.where(lengths_m >= apart_m, lengths_m, np.inf)
    found = list[tuple[int, int]]()
    for start, row in enumerate(lengths_m):
        near = np.flatnonzero(np.isfinite(row))
        by_third_m = (steps_m[start, near, None] + steps_m[np.ix_(near, near)]).min(axis=0, initial=np.inf)
        found += [(start, int(end)) for end in near[by_third_m >= _DETOUR * row[near]]]
    return found
