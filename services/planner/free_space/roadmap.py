"""Roadmap of a ground for a body that drives straight and turns on the spot.

Its places are the corners of the obstructed ground, kept off by the body's half widths and by its turning circle, and
the medial axis of the free ground. At a place the body may turn within each range of headings that is free.
"""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray

from touchline.core.robust_overlay import as_area, buffer, difference, union
from touchline.services.planner.free_space.body_sweeps import cheapest
from touchline.services.planner.free_space.legs import STOP_M, Legs, WalledBody
from touchline.services.planner.free_space.obstructed_ground import ObstructedGround
from touchline.services.planner.geometry.clothoid import Floats, Ints, PathPose

SECTORS = 72
"""Sectors of heading that are checked at each place,"""
SECTORS_FINER = 360
"""and on a finer map: beside a wall, few headings of a body are free."""
# Distance of the body from a corner that it drives round (m).
OFF_M = 0.02
# Spacing of samples of walls for the medial axis, and of the places on it (m).
SAMPLE_M, SPACING_M = 0.25, 0.2
# Factor by which places are closer where the body cannot turn.
NARROW = 2
# Number of samples of walls beyond which both are farther apart.
SAMPLES_MAX = 20_000
# Spacing of corners, and error that they may have (m).
CORNER_SPACING_M, SIMPLIFIED_M = 0.05, 0.02
# Number of nearest places that a place is joined with: corners with corners, and places of the medial axis with all.
CORNERS, NEAREST = 60, 30
# Number of nearest places that a start or a goal is joined with.
ENTRIES = 500
# Grounds whose medial axes are kept.
GROUNDS_KEPT = 8


class Roadmap:
    """Places on a ground, and the straights between them that a body can drive.

    A vertex of its graph is a place with one of the ranges of heading that are free there.
    """

    def __init__(self, body: WalledBody, finer: int = 1) -> None:
        """Find the places and the straights.

        Args:
            body: The body among walls.
            finer: Factor by which places are closer to each other and joined with more others.
        """
        self._body, self._nearest_places = body, ENTRIES * finer
        self._sectors = SECTORS if finer == 1 else SECTORS_FINER
        corners, axis = _corner_places(body, CORNER_SPACING_M / finer), _axis_places(body, finer)
        self._places = np.concatenate((corners, axis))
        self._vertex = _ranges(body.turning(self._places, self._sectors))
        self._count = int(self._vertex.max(initial=-1)) + 1
        self._place = np.zeros(self._count, np.int64)
        rows, sectors = np.nonzero(self._vertex >= 0)
        self._place[self._vertex[rows, sectors]] = rows
        first, second = _near(self._places, len(corners), finer).T
        ends = np.hstack((self._places[first], self._places[second]))
        edges = []
        for sign, heading in self._headings(ends):
            a, b = self._vertices(first, heading), self._vertices(second, heading)
            fits = (a >= 0) & (b >= 0) & ~np.isnan(heading)
            costs = np.hypot(*(ends[fits, 2:] - ends[fits, :2]).T) + STOP_M
            edges.append(np.column_stack((a[fits], b[fits], costs, np.full(len(costs), sign))))
            edges.append(edges[-1][:, (1, 0, 2, 3)] * (1.0, 1.0, 1.0, -1.0))
        table = np.concatenate(edges)
        if not body.backs:
            table = table[table[:, 3] > 0.0]
        table = table[np.argsort(table[:, 0], kind="stable")]
        self._offsets = np.searchsorted(table[:, 0], np.arange(self._count + 1))
        self._targets, self._costs = table[:, 1].astype(np.int64), np.ascontiguousarray(table[:, 2])
        self._signs = table[:, 3]

    def way(self, start: PathPose, goal: PathPose) -> Legs | None:
        """Short way from a start to a goal, whose heading may be NaN for any; None if none is found."""
        direct = [self._body.legs(np.array((_row(start), _row(goal, sign))), start, goal) for sign in self._body.senses]
        if found := [legs for legs in direct if legs is not None]:
            return min(found, key=lambda legs: float(np.abs(legs.turns_rad).sum()))
        entry, exit_ = self._entries(start, 1.0), self._entries(goal, -1.0)
        costs, before = cheapest(entry[0], self._offsets, self._targets, self._costs)
        total = costs + exit_[0]
        last = int(np.argmin(total)) if len(total) else 0
        if not len(total) or math.isinf(total[last]):
            return None
        chain = [last]
        while before[chain[-1]] >= 0:
            chain.append(int(before[chain[-1]]))
        chain.reverse()
        rows = [_row(start), (*self._places[self._place[chain[0]]], entry[1][chain[0]])]
        rows += [(*self._places[self._place[b]], self._sign(a, b)) for a, b in pairwise(chain)]
        return self._body.legs(np.array([*rows, _row(goal, -exit_[1][last])]), start, goal)

    def _entries(self, pose: PathPose, ahead: float) -> tuple[Floats, Floats]:
        """Costs (n,) of the straights from a pose to each vertex, and their directions; `ahead` is that of forward."""
        costs, signs = np.full(self._count, np.inf), np.ones(self._count)
        off = np.hypot(*(self._places - (pose.x_m, pose.y_m)).T)
        near = np.argsort(off, kind="stable")[: self._nearest_places]
        ends = np.hstack((np.broadcast_to((pose.x_m, pose.y_m), (len(near), 2)), self._places[near]))
        here = _ranges(self._body.turning(np.array([[pose.x_m, pose.y_m]]), self._sectors))[0]
        allowed = here >= 0
        if not math.isnan(pose.heading_rad):
            allowed &= here == here[_sector(np.array([pose.heading_rad]), self._sectors)[0]]
        for sign, heading in self._headings(ends):
            if not self._body.backs and sign != ahead:
                continue
            vertices = self._vertices(near, heading)
            fits = (vertices >= 0) & ~np.isnan(heading)
            fits &= allowed[_sector(heading, self._sectors)]
            better = fits & (off[near] + STOP_M < costs[vertices])
            costs[vertices[better]], signs[vertices[better]] = off[near][better] + STOP_M, sign
        return costs, signs

    def _headings(self, ends: Floats) -> list[tuple[float, Floats]]:
        """Headings (n,) of straights (n, 4) driven forward (1.0), and backward (−1.0); NaN where they are not free."""
        ahead, free = np.arctan2(ends[:, 3] - ends[:, 1], ends[:, 2] - ends[:, 0]), self._body.drives(ends)
        return [
            (1.0, np.where(free & 1, ahead, np.nan)),
            (-1.0, np.where(free & 2, ahead + math.pi, np.nan)),
        ]

    def _vertices(self, places: Ints, headings: Floats) -> Ints:
        """Vertices of places at headings; −1 where the body cannot turn there."""
        return self._vertex[places, _sector(headings, self._sectors)]

    def _sign(self, a: int, b: int) -> float:
        """Direction of the cheapest straight from one vertex to another."""
        edges = slice(self._offsets[a], self._offsets[a + 1])
        costs = np.where(self._targets[edges] == b, self._costs[edges], np.inf)
        return float(self._signs[edges][np.argmin(costs)])


def _row(pose: PathPose, sign: float = 1.0) -> tuple[float, float, float]:
    return pose.x_m, pose.y_m, sign


def _sector(headings: Floats, sectors: int) -> Ints:
    found = np.floor(np.nan_to_num(headings) % math.tau / math.tau * sectors).astype(np.int64)
    return np.minimum(found, sectors - 1)


def _ranges(free: NDArray[np.bool_]) -> Ints:
    """Number ranges of free sectors of all places; −1 where a sector is not free. A range may go on past the end."""
    begins = free & ~np.roll(free, 1, axis=1)
    begins[free.all(axis=1), 0] = True
    numbers = np.cumsum(begins.ravel()).reshape(free.shape) - 1
    last = np.cumsum(begins.sum(axis=1)) - 1  # the range that goes on past the end of a row is its last
    numbers = np.where(np.maximum.accumulate(begins, axis=1), numbers, last[:, None])
    return np.where(free, numbers, -1)


def _corner_places(body: WalledBody, spacing_m: float) -> Floats:
    """Corners of the ground less the body's half widths and its reach."""
    sides = body.corners[:, 1]
    found = [np.empty((0, 2))]
    for off in sorted({float(sides.max()), float(-sides.min()), body.reach_m}):
        kept = _kept_off(body.ground.free, off + OFF_M).simplify(SIMPLIFIED_M)
        found.append(shapely.get_coordinates(kept))
    return _thinned(np.concatenate(found), spacing_m)


def _kept_off(free: shapely.Polygon | shapely.MultiPolygon, off_m: float) -> shapely.Polygon | shapely.MultiPolygon:
    """Ground less a margin; hole by hole, which is many times quicker than all at once."""
    parts = []
    for part in shapely.get_parts(free):
        holes = [buffer(shapely.Polygon(ring), off_m, join_style="mitre") for ring in part.interiors]
        parts.append(difference(buffer(shapely.Polygon(part.exterior), -off_m, join_style="mitre"), union(holes)))
    return as_area(union(parts))


def _axis_places(body: WalledBody, finer: int) -> Floats:
    """Places in the middle between walls, where the narrowest part of the body has room."""
    coarser = max(body.ground.free.length / SAMPLE_M / SAMPLES_MAX, 1.0) / finer
    vertices = _axis(body.ground, SAMPLE_M * coarser / NARROW)
    least = min(float(body.corners[:, 1].max()), float(-body.corners[:, 1].min()))
    off_m = body.off_walls(vertices, body.reach_m)
    turns, narrow = off_m > body.reach_m, (off_m > 0.9 * least) & (off_m <= body.reach_m)
    narrow_places = _thinned(vertices[narrow], SPACING_M * coarser / NARROW)
    return np.concatenate((narrow_places, _thinned(vertices[turns], SPACING_M * coarser)))


@lru_cache(GROUNDS_KEPT)
def _axis(ground: ObstructedGround, spacing_m: float) -> Floats:
    """Vertices (n, 2) of the Voronoi diagram of samples of the walls; the same for every margin."""
    samples = shapely.MultiPoint(shapely.get_coordinates(shapely.segmentize(ground.free, spacing_m)))
    vertices = shapely.get_coordinates(shapely.voronoi_polygons(samples, only_edges=True))
    shapely.prepare(ground.free)
    return np.ascontiguousarray(vertices[shapely.contains_xy(ground.free, vertices)])


def _thinned(places: Floats, spacing_m: float) -> Floats:
    """One of the places (n, 2) in each square of a grid."""
    squares = np.floor(places / spacing_m).astype(np.int64)
    _, kept = np.unique(_keys(squares), return_index=True)
    return places[np.sort(kept)]


def _near(places: Floats, corners: int, finer: int) -> Ints:
    """Pairs (n, 2) of places that straights are looked for between."""
    nearest, among = _nearest(places, NEAREST * finer), _nearest(places[:corners], CORNERS * finer)
    pairs = np.sort(np.concatenate((nearest, among)), axis=1)
    _, kept = np.unique(_keys(pairs), return_index=True)
    found: Ints = pairs[kept]
    return found


def _keys(pairs: Ints) -> Ints:
    """One number for each of some pairs (n, 2), in the order of the pairs; much quicker to sort."""
    low, high = pairs.min(axis=0, initial=0), pairs.max(axis=0, initial=0)
    keys: Ints = (pairs[:, 0] - low[0]) * (high[1] - low[1] + 1) + pairs[:, 1] - low[1]
    return keys


def _nearest(places: Floats, count: int) -> Ints:
    """Pairs (n, 2) of each place and those nearest to it."""
    from scipy.spatial import KDTree  # here: few ways lead over known ground

    if len(places) < 2:
        return np.empty((0, 2), dtype=np.int64)
    _, others = KDTree(places).query(places, min(count + 1, len(places)))
    pairs = np.column_stack((np.repeat(np.arange(len(places)), others.shape[1]), others.ravel()))
    apart: Ints = pairs[pairs[:, 0] != pairs[:, 1]]
    return apart
