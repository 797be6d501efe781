"""Outlines of things that the plan knows: they explain returns, and are missed where the ground is seen free."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import borrowing, kernel
from touchline.core.polygons import off_squared
from touchline.onboard.perception.fading_grid import CELL_M, CELLS, FadingGrid
from touchline.onboard.perception.scan import GROUND, KNOWN, THING, Beams, inside

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Polygon = Sequence[tuple[float, float]]

TOLERANCE_M: Final = 0.15
"""Distance from a known outline, beside errors, within which it explains a return."""
_MOST_TOLERANCE_M: Final = 0.5
_CELL_M: Final = 2.0
_SAMPLE_M: Final = 0.2
_FREE_LOG_ODDS: Final = -1.5
_FREE_SHARE: Final = 0.8
"""Share of an outline that must be seen free for the thing to be missing."""
_SHOWN_S: Final = 1.0
_UNSEEN_S: Final = 2.0
"""Time for which nothing of it may have been seen."""


class _Index(NamedTuple):
    """Pieces of the outlines' edges by the cells that they are near.

    Attributes:
        keys: (cells,) keys of cells, ascending.
        starts: (cells + 1,) where the pieces of each begin.
        pieces: (n, 4) ends x, y of each.
        owners: (n,) outline of each.
        corners: (k, 2) corners of all outlines.
        first: (outlines + 1,) where the corners of each begin.
        boxes: (outlines, 4) least x and y, greatest x and y of each, grown by the tolerance.
    """

    keys: Integers
    starts: Integers
    pieces: Floats
    owners: Integers
    corners: Floats
    first: Integers
    boxes: Floats


@kernel
def _key(x: int, y: int) -> int:
    return (x << 32) + y


def _cells_of(piece: Floats) -> list[int]:
    low, high = np.minimum(piece[:2], piece[2:]) - _MOST_TOLERANCE_M, np.maximum(piece[:2], piece[2:])
    (x0, y0), (x1, y1) = (np.floor(each / _CELL_M).astype(int).tolist() for each in (low, high + _MOST_TOLERANCE_M))
    return [(x << 32) + y for x in range(x0, x1 + 1) for y in range(y0, y1 + 1)]


def _cut(polygon: Floats, longest_m: float) -> list[Floats]:
    """Cut a polygon's edges into pieces, (4,) each, of at most this length."""
    pieces = []
    for a, b in zip(polygon, np.roll(polygon, -1, 0), strict=True):
        count = max(math.ceil(math.hypot(*(b - a)) / longest_m), 1)
        ends = a + np.linspace(0.0, 1.0, count + 1)[:, None] * (b - a)
        pieces += list(np.hstack((ends[:-1], ends[1:])))
    return pieces


def _indexed(polygons: Sequence[Floats]) -> _Index:
    owned = [(owner, piece) for owner, polygon in enumerate(polygons) for piece in _cut(polygon, _CELL_M)]
    rows = sorted((key, n) for n, (_, piece) in enumerate(owned) for key in _cells_of(piece))
    keys, starts = np.unique(np.array([key for key, _ in rows], np.int64), return_index=True)
    order = [n for _, n in rows]
    boxes = [(*(each.min(0) - _MOST_TOLERANCE_M), *(each.max(0) + _MOST_TOLERANCE_M)) for each in polygons]
    return _Index(
        keys,
        np.append(starts, len(rows)).astype(np.int64),
        np.array([owned[n][1] for n in order]),
        np.array([owned[n][0] for n in order], np.int64),
        np.vstack(polygons),
        np.cumsum([0, *map(len, polygons)]),
        np.array(boxes),
    )


@kernel
def _owner_of(x: float, y: float, tolerance_m: float, index: _Index) -> int:
    """Return the outline whose edge is nearest to a place; −1 if none is within the tolerance."""
    key, low, high = _key(math.floor(x / _CELL_M), math.floor(y / _CELL_M)), 0, len(index.keys)
    while low < high:
        middle = (low + high) // 2
        if index.keys[middle] < key:
            low = middle + 1
        else:
            high = middle
    owner, least = -1, tolerance_m * tolerance_m
    if low < len(index.keys) and index.keys[low] == key:
        for n in range(index.starts[low], index.starts[low + 1]):
            piece = index.pieces[n]
            off = off_squared(complex(x, y), complex(piece[0], piece[1]), complex(piece[2], piece[3]))
            if off <= least:
                owner, least = index.owners[n], off
    return owner


@kernel
def _holder_of(x: float, y: float, near: Integers, count: int, index: _Index) -> int:
    """Return the first of the near outlines that a place lies in; −1 if there is none."""
    boxes = index.boxes
    for k in range(count):
        n = int(near[k])
        within = boxes[n, 0] <= x <= boxes[n, 2] and boxes[n, 1] <= y <= boxes[n, 3]
        if within and inside(x, y, index.corners[index.first[n] : index.first[n + 1]]):
            return n
    return -1


@borrowing
def _any_reaches(boxes: Floats, x: float, y: float, far_m: float) -> bool:
    """Return whether a box (n, 4), as in `_Index`, reaches into a square round a place."""
    for n in range(len(boxes)):
        near_x = boxes[n, 0] < x + far_m and boxes[n, 2] > x - far_m
        if near_x and boxes[n, 1] < y + far_m and boxes[n, 3] > y - far_m:
            return True
    return False


@borrowing
def explain(beams: Beams, tolerance_m: float, index: _Index, near: Integers, time_s: float, seen_s: Floats) -> None:
    """Change the kind of returns that an outline explains.

    Args:
        beams: The scan.
        tolerance_m: Distance from an outline up to which it explains a return.
        index: The outlines.
        near: (outlines,) memory.
        time_s: Present time.
        seen_s: (outlines,) time at which each was seen last; changed.
    """
    x, y, far = beams.rays[0, 0], beams.rays[0, 1], 0.0
    for i in range(len(beams.kind)):
        if beams.kind[i] == THING or beams.kind[i] == GROUND:
            far = max(far, beams.range_m[i])
    far, count = far + _MOST_TOLERANCE_M, 0
    for n in range(len(index.boxes)):
        box = index.boxes[n]
        if box[0] - far <= x <= box[2] + far and box[1] - far <= y <= box[3] + far:
            near[count] = n
            count += 1
    for i in range(len(beams.kind)):
        if count == 0 or (beams.kind[i] != THING and beams.kind[i] != GROUND):
            continue
        x, y = beams.points_m[i]
        owner = _owner_of(x, y, tolerance_m, index)
        if owner < 0:
            owner = _holder_of(x, y, near, count, index)
        if owner >= 0:
            beams.kind[i] = KNOWN
            seen_s[owner] = time_s


class SeenOutline(NamedTuple):
    """An outline that the plan knows and the robot sees, or misses.

    Attributes:
        place: Place in the plan's list, from 0.
        outline_m: (k, 2) corners, map frame.
        missing: True if its place was seen to be free.
        seen_s: Time at which it was last seen; −inf before.
    """

    place: int
    outline_m: Floats
    missing: bool
    seen_s: float


class KnownOutlines:
    """Outlines that the plan knows.

    Args:
        outlines: Corners (x, y) of each, map frame [m].

    Attributes:
        outlines: (k, 2) corners of each.
        seen_s: (outlines,) time at which a return was last explained by each; −inf before.
        missing: (outlines,) True for those whose place was seen to be free.
    """

    def __init__(self, outlines: Sequence[Polygon]) -> None:
        self.outlines = [np.array(each, dtype=np.float64) for each in outlines]
        self.seen_s = np.full(len(outlines), -math.inf)
        self.missing = np.zeros(len(outlines), np.bool_)
        self._index = _indexed(self.outlines) if self.outlines else None
        self._samples = [np.array(_cut(each, _SAMPLE_M))[:, :2] for each in self.outlines]
        self._near, self._looked_s = np.zeros(len(outlines), np.int64), -math.inf

    def any_near(self, x: float, y: float, far_m: float) -> bool:
        """Return whether an outline may reach into a square.

        Args:
            x: Centre of the square, with `y`, map frame.
            y: Its other coordinate.
            far_m: Half of its side.
        """
        if self._index is None:
            return False
        return bool(_any_reaches(self._index.boxes, x, y, far_m))

    def explain(self, beams: Beams, error_m: float, time_s: float) -> None:
        """Change the kind of returns near an outline to known.

        Args:
            beams: The scan.
            error_m: Bound on the returns' errors on the map.
            time_s: Present time.
        """
        if self._index is None:
            return
        tolerance_m = min(TOLERANCE_M + error_m, _MOST_TOLERANCE_M)
        explain(beams, tolerance_m, self._index, self._near, time_s, self.seen_s)

    def seen(self, time_s: float) -> list[SeenOutline]:
        """Return the outlines that were seen in the last second, or are missing.

        Args:
            time_s: Present time.
        """
        shown = np.flatnonzero(self.missing | (self.seen_s >= time_s - _SHOWN_S)).tolist()
        return [SeenOutline(n, self.outlines[n], bool(self.missing[n]), float(self.seen_s[n])) for n in shown]

    def newly_missing(self, grid: FadingGrid, time_s: float) -> list[int]:
        """Return the outlines, by their place in the list, that are found to be missing now; at most once a second.

        Args:
            grid: Occupancy of the surroundings.
            time_s: Present time.
        """
        if not self.outlines or time_s - self._looked_s < 1.0:
            return []
        self._looked_s = time_s
        low = grid.corner * CELL_M
        self.missing[self.seen_s >= time_s - _UNSEEN_S] = False
        found = []
        for n in np.flatnonzero(~self.missing & (self.seen_s < time_s - _UNSEEN_S)).tolist():
            samples = self._samples[n]
            if (samples < low).any() or (samples >= low + CELLS * CELL_M).any():
                continue
            i, j = (np.floor(samples / CELL_M).astype(int) % CELLS).T
            odds = grid.cells[i, j]
            if (odds <= 0.0).all() and (odds < _FREE_LOG_ODDS).mean() >= _FREE_SHARE:
                self.missing[n] = True
                found.append(n)
        return found
