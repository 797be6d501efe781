"""Ground as a robot has seen it on its way to a goal: where returns were, and where beams passed."""

from __future__ import annotations

import math
from typing import Final, NamedTuple, Self

import numpy as np
import shapely
from numpy.typing import NDArray

from touchline.core.jit import borrowing, kernel
from touchline.onboard.perception.scan import KNOWN, NOTHING, THING, UNUSABLE, Beams
from touchline.schemas.known_ground import KnownGround

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]
Counts = NDArray[np.int8]

CELL_M: Final = 0.04
SIDE: Final = 1024
"""Cells of a side, a power of two: the ground is remembered up to 20 m from the robot."""
_MASK: Final = SIDE - 1
OCCUPIED: Final = 2
"""Evidence from which a cell is occupied: that of one scan with a return."""
_MOST: Final = 6
_NEWER: Final = 0.2
"""Share of the newest return in the mean place of a cell's."""
_RETURN: Final = 2
_EDGE_M: Final = 0.1
_EDGE_SPACINGS: Final = 7.0
"""Difference in range between neighbours from which there is an edge: the least one, and over the spacing of beams, as
that of a surface seen at 8 degrees."""
FREE: Final = -1
"""Evidence of a cell that beams have passed."""
FADED_S: Final = 60.0
"""Time after which a return that was not seen again may be forgotten."""
_KNOWN_M: Final = 0.1
"""Distance from a known outline within which returns are its own."""
_BEFORE_RETURN_M: Final = 1.5 * CELL_M
_SURFACE_M: Final = 0.1
"""Distance of the returns from whose places the direction of a surface follows."""
_ALONG: Final = math.cos(2.0 * math.radians(15.0))
"""Cosine of twice the angle to a surface up to which a beam passes along it, and may meet it by an error alone."""
_ALONG_SCANS: Final = 20
"""Number of scans of which one counts for a cell that such beams pass, if more than one scan had a return there."""


class _Cells(NamedTuple):
    """Cells round the robot, each at its place on the map modulo SIDE.

    Attributes:
        corner: (2,) lower left corner, cells from the map's origin.
        evidence: (SIDE, SIDE) evidence of things; negative where beams have passed.
        seen_tick: (SIDE, SIDE) tick of the last return.
        marks: (SIDE, SIDE) number of the last scan with a return, or a beam that passed.
        place_m: (SIDE, SIDE, 2) mean place of the last returns.
        along: (SIDE, SIDE, 2) cosine and sine of twice the direction of the surface there, mean of the last returns.
        stands: (SIDE, SIDE) whether an outline that the plan knows explained the last return.
    """

    corner: Integers
    evidence: Counts
    seen_tick: Integers
    marks: Integers
    place_m: Floats
    along: Floats
    stands: Flags

    @classmethod
    def unknown(cls) -> Self:
        """Return cells of which nothing is known."""
        seen_tick, marks = (np.zeros((SIDE, SIDE), np.int64) for _ in range(2))
        place_m, along = (np.zeros((SIDE, SIDE, 2)) for _ in range(2))
        stands = np.zeros((SIDE, SIDE), np.bool_)
        # Of small numbers, as all of them are looked through after each scan.
        return cls(np.zeros(2, np.int64), np.zeros((SIDE, SIDE), np.int8), seen_tick, marks, place_m, along, stands)


@kernel
def _move(cells: _Cells, x: int, y: int) -> None:
    """Move the lower left corner; cells that come in are unknown."""
    corner = cells.corner
    if x == corner[0] and y == corner[1]:
        return
    for i in range(x, x + SIDE):
        for j in range(y, y + SIDE):
            if not (corner[0] <= i < corner[0] + SIDE and corner[1] <= j < corner[1] + SIDE):
                cells.evidence[i & _MASK, j & _MASK] = 0
    corner[0], corner[1] = x, y


@kernel
def _range_m(beams: Beams, b: int) -> float:
    return math.inf if beams.kind[b] == NOTHING else float(beams.range_m[b])


@kernel
def _is_split(beams: Beams, b: int) -> bool:
    """Return whether a return is between a nearer and a farther neighbour, as that of a beam split over an edge is."""
    if b == 0 or b == len(beams.kind) - 1:
        return False
    before_m, here_m, after_m = _range_m(beams, b - 1), _range_m(beams, b), _range_m(beams, b + 1)
    ray, following = beams.rays[b], beams.rays[b + 1]
    spacing_m = here_m * abs(ray[2] * following[3] - ray[3] * following[2])
    edge_m = max(_EDGE_M, _EDGE_SPACINGS * spacing_m)
    return bool(min(before_m, after_m) + edge_m < here_m < max(before_m, after_m) - edge_m)


@kernel
def _surface(beams: Beams, b: int) -> tuple[float, float]:
    """Return cosine and sine of twice the direction of the surface that a return is from; 0 if there is no telling."""
    other = b + 1 if b + 1 < len(beams.kind) else b - 1
    ray, following = beams.rays[b], beams.rays[other]
    spacing_m = beams.range_m[b] * abs(ray[2] * following[3] - ray[3] * following[2])
    step = max(int(_SURFACE_M / max(spacing_m, CELL_M / 8.0)), 1)
    least_m, cos, sin = math.inf, 0.0, 0.0
    for other in (b - step, b + step):
        if not 0 <= other < len(beams.kind) or beams.kind[other] == UNUSABLE:
            continue
        if math.isfinite(_range_m(beams, other)):
            x, y = beams.points_m[other] - beams.points_m[b]
            squared = x * x + y * y
            if 0.0 < squared < least_m:
                least_m, cos, sin = squared, (x * x - y * y) / squared, 2.0 * x * y / squared
    return cos, sin


@kernel
def _is_edge_on(ray: Floats, along: Floats) -> bool:
    """Return whether a beam passes along the surface in a cell."""
    cos, sin = ray[2] * ray[2] - ray[3] * ray[3], 2.0 * ray[2] * ray[3]
    return bool(cos * along[0] + sin * along[1] > _ALONG)


@borrowing
def _enter_scan(beams: Beams, counts: Flags, free_m: float, tick: int, scan: int, cells: _Cells) -> None:
    """Enter a scan: cells with returns gain evidence, those that beams pass lose some."""
    x, y = cells.corner[0], cells.corner[1]
    for b in range(len(beams.kind)):
        if counts[b] and not _is_split(beams, b):
            i, j = math.floor(beams.points_m[b, 0] / CELL_M), math.floor(beams.points_m[b, 1] / CELL_M)
            if x <= i < x + SIDE and y <= j < y + SIDE:
                i, j = i & _MASK, j & _MASK
                cells.stands[i, j] = beams.kind[b] == KNOWN
                share, along = 1.0 if cells.evidence[i, j] <= 0 else _NEWER, _surface(beams, b)
                for k in range(2):
                    cells.place_m[i, j, k] += share * (beams.points_m[b, k] - cells.place_m[i, j, k])
                    cells.along[i, j, k] += share * (along[k] - cells.along[i, j, k])
                if cells.marks[i, j] != scan:
                    cells.evidence[i, j] = min(max(cells.evidence[i, j], 0) + _RETURN, _MOST)
                    cells.marks[i, j], cells.seen_tick[i, j] = scan, tick
    for b in range(len(beams.kind)):
        if beams.kind[b] == UNUSABLE:
            continue
        far_m = free_m if beams.kind[b] == NOTHING else beams.range_m[b] - _BEFORE_RETURN_M
        ray = beams.rays[b]
        for k in range(1, int(min(far_m, free_m) / CELL_M)):
            i = math.floor(ray[0] / CELL_M + k * ray[2])
            j = math.floor(ray[1] / CELL_M + k * ray[3])
            if not (x <= i < x + SIDE and y <= j < y + SIDE):
                break
            i, j = i & _MASK, j & _MASK
            if cells.marks[i, j] != scan:
                if cells.evidence[i, j] > OCCUPIED and scan % _ALONG_SCANS and _is_edge_on(ray, cells.along[i, j]):
                    continue
                cells.marks[i, j] = scan
                cells.evidence[i, j] = max(cells.evidence[i, j] - 1, FREE)


class SeenGround:
    """Returns of things that the plan does not know, and ground that was seen as free, in cells of the map.

    Args:
        known: Ground that the plan knows: returns beside its outlines are no news.

    Attributes:
        known: The same.
    """

    def __init__(self, known: KnownGround) -> None:
        self.known = known
        self._cells, self._scans = _Cells.unknown(), 0
        outlines = [shapely.Polygon(each.corners, each.holes) for each in known.obstacles]
        rings = [] if known.boundary is None else [shapely.LinearRing(known.boundary)]
        self._explained = shapely.union_all([each.buffer(_KNOWN_M) for each in (*outlines, *rings)])
        shapely.prepare(self._explained)

    def enter(self, beams: Beams, free_m: float, tick: int) -> None:
        """Enter a scan.

        Args:
            beams: The scan, with its kinds.
            free_m: Range up to which a beam without a return was free.
            tick: Present tick.
        """
        self._scans += 1
        last = beams.rays[-1]
        # The corner moves in steps, as whole rows and columns are cleared.
        x, y = (64 * round(float(value) / CELL_M / 64.0) - SIDE // 2 for value in last[:2])
        _move(self._cells, x, y)
        counts = (beams.kind == THING) | (beams.kind == KNOWN)
        if not self._explained.is_empty:
            counts[counts] &= ~shapely.contains_xy(self._explained, beams.points_m[counts])
        _enter_scan(beams, counts, free_m, tick, self._scans, self._cells)

    def stands_on(self, body: shapely.geometry.base.BaseGeometry) -> None:
        """Enter the ground under the robot's body as free."""
        i, j = (np.floor(cell_middles(body) / CELL_M).astype(np.int64) & _MASK).T
        self._cells.evidence[i, j] = FREE

    @property
    def places_m(self) -> tuple[Floats, Floats]:
        """Mean places (n, 2) of returns that outlines explain, though not on them, and of those of what may move."""
        occupied = self._occupied()
        places_m, stand = self._cells.place_m.reshape(-1, 2)[occupied], self._cells.stands.ravel()[occupied]
        return np.ascontiguousarray(places_m[stand]), np.ascontiguousarray(places_m[~stand])

    def forget(self, before_tick: int) -> None:
        """Forget returns that were not seen again since a tick.

        Args:
            before_tick: The tick.
        """
        occupied = self._occupied()
        self._cells.evidence.ravel()[occupied[self._cells.seen_tick.ravel()[occupied] < before_tick]] = 0

    def _occupied(self) -> Integers:
        """Return the numbers of occupied cells, row by row: of one axis, as it is looked for ten times as fast."""
        return np.flatnonzero(self._cells.evidence.ravel() >= OCCUPIED)

    def free(self, points_m: Floats) -> Flags:
        """Return whether each of some points (n, 2) lies in or beside a cell that was seen as free, and on no thing."""
        cells = np.floor(points_m / CELL_M).astype(np.int64)
        inside = np.all((cells > self._cells.corner) & (cells < self._cells.corner + SIDE - 1), axis=1)
        around = np.stack([self._evidence(cells + np.array((i, j))) for i in (-1, 0, 1) for j in (-1, 0, 1)])
        found: Flags = inside & (around < 0).any(axis=0) & (self._evidence(cells) < OCCUPIED)
        return found

    def _evidence(self, cells: Integers) -> Counts:
        i, j = (cells & _MASK).T
        found: Counts = self._cells.evidence[i, j]
        return found


def cell_middles(area: shapely.geometry.base.BaseGeometry) -> Floats:
    """Return the middles (n, 2) of the cells in an area."""
    if area.is_empty:
        return np.empty((0, 2))
    west, south, east, north = np.floor(np.array(area.bounds) / CELL_M).astype(int).tolist()
    places = (np.argwhere(np.ones((east - west + 1, north - south + 1))) + (west, south) + 0.5) * CELL_M
    inside: Floats = places[shapely.contains_xy(area, places)]
    return inside
