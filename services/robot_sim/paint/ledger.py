"""Ledger of the true paint, and of the coverage of the lines to be painted so far."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Sequence
from functools import cached_property
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.intervals import Intervals
from touchline.schemas.template import DEFAULT_TOLERANCE_M
from touchline.services.robot_sim.paint import projection as p
from touchline.services.robot_sim.paint.cell_grid import make_grid
from touchline.services.robot_sim.paint.targets import Target
from touchline.services.robot_sim.world import body

_FIRST_POINTS: Final = 4096
_ROOM: Final = 2 * p.MOST_RUNS
_MOST_STRETCHES: Final = 3 * p.MOST_RUNS  # of one line in a tick
_GOES_ON_M: Final = 2.0 * p.THIN_M

Floats = NDArray[np.float64]


class Marks(NamedTuple):
    """Stretch of one stroke that belongs to one line."""

    target: int
    """Index of the line, −1 for none."""
    first_index: int
    """Index of its first point, in the count of all points of the session."""
    width_m: float
    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]


class PaintStroke(NamedTuple):
    """Path of the nozzle while paint flowed evenly: (n, 2) points [m], and the width of the paint [m]."""

    points: Floats
    width_m: float


class Deviation(NamedTuple):
    """Distance of the nozzle from its line, once per tick of spraying that belongs to one."""

    target: NDArray[np.int64]
    lateral_m: NDArray[np.float64]


class PaintLedger:
    """True paint, collected tick by tick.

    A stroke is the true path of the nozzle from the opening of the valve to its closing, in the map frame; its points
    lie 10 ms apart, except for the first and the last, which are exact to 1 ms. Where the width of the paint changes,
    another stroke begins. A point takes 40 bytes. Of strokes that are thinned a point is kept every 5 cm, or degree of
    turn, and where they turn back: a day of rolling fits, and the edge of the rolled ground moves by well under a
    millimetre.

    Args:
        targets: Lines to be painted.
        line_width_m: Width of the lines: paint counts within half of it.
        spray_width_m: Width of the paint.
        tolerance_m: Largest distance of the middle of the paint from its line.
        thins: True if strokes are thinned.

    Attributes:
        ids: Ids of the targets.
        length_m: Total length to be painted.
    """

    def __init__(
        self,
        targets: Sequence[Target],
        line_width_m: float,
        spray_width_m: float,
        tolerance_m: float = DEFAULT_TOLERANCE_M,
        *,
        thins: bool = False,
    ) -> None:
        self.targets, self._thins = list(targets), thins
        self.tolerance_m = tolerance_m
        self.ids = tuple(target.id for target in self.targets)
        self.line_width_m, self.spray_width_m = line_width_m, spray_width_m
        self._lengths: NDArray[np.float64] = np.array([t.curve.length_m for t in self.targets], dtype=np.float64)
        self.length_m = math.fsum(self._lengths)
        table = np.array(
            [(c.x_m, c.y_m, c.heading_rad, c.curvature_1pm, c.length_m) for _, c in self.targets], dtype=np.float64
        ).reshape(-1, 5)
        self._lines = p.Lines(table, make_grid([target.curve for target in self.targets], p.REACH_M))
        self._points: NDArray[np.float64] = np.zeros((_FIRST_POINTS, p.POINT_COLUMNS))
        self._state = p.LedgerState()
        self._coverage = self._nothing(self._state)
        self._seen: NDArray[np.float64] = self._coverage.latest.copy()
        self._covered = [Intervals() for _ in self.targets]
        self._covered_m: NDArray[np.float64] = np.zeros(len(self.targets))
        self._taken = 0  # index of the point at which the next batch of marks begins

    def snapshot(self) -> PaintLedger:
        """Copy the paint so far, for another thread to evaluate while the robot paints on."""
        frozen = copy.copy(self)
        frozen._points, frozen._state = self.rows(0).copy(), copy.deepcopy(self._state)
        frozen._coverage = self._nothing(frozen._state)._replace(latest=self._coverage.latest.copy())
        frozen._seen, frozen._covered_m = self._seen.copy(), self._covered_m.copy()
        frozen._covered = copy.deepcopy(self._covered)
        return frozen

    def record(self, trace: NDArray[np.float64]) -> None:
        """Enter one tick; `trace` is (STEPS + 1, 3), the world's."""
        self.make_room()
        self._enter(trace, self.paint)
        self.put_aside()

    @cached_property
    def _enter(self) -> Callable[..., None]:
        """The kernel `projection.enter`, without checking the types of its arguments, which are always the same."""
        code: Callable[..., None] = p.enter.for_types_of((np.zeros(body.TRACE_SHAPE), self.paint))
        return code

    @property
    def paint(self) -> p.PaintArrays:
        """Arrays for `projection.enter`."""
        return p.PaintArrays(self._lines, 0.5 * self.line_width_m, self._points, self._coverage, self._thins)

    def _nothing(self, state: p.LedgerState) -> p.Coverage:
        """Make a coverage without any covered line; `state` is that of the ledger."""
        latest: Floats = np.tile((1.0, -1.0), (len(self.targets), 1))
        room = _MOST_STRETCHES * max(1, self._lines.grid.largest)
        return p.Coverage(latest, np.zeros((room, p.STRETCH_COLUMNS)), state.array)

    def make_room(self) -> None:
        """Make room for the points of at least one more tick."""
        if self._state.points + _ROOM > len(self._points):
            self._points = np.concatenate((self._points, np.zeros_like(self._points)))

    def put_aside(self) -> None:
        """Take over the stretches that the nozzle has left for good."""
        if not self._state.stretches:
            return
        for target, start, end in self._coverage.stretches[: self._state.stretches].tolist():
            self._covered[int(target)].add(start, end)
        self._state.stretches = 0

    @property
    def points(self) -> int:
        """Number of points of all strokes so far."""
        return self._state.points

    @property
    def settled(self) -> int:
        """Number of points that will not change: all, or all but the end of a thinned stroke that continues."""
        return self._state.settled

    @property
    def covered(self) -> list[Intervals]:
        """Stretches under paint of each target."""
        latest = self._coverage.latest
        changed = np.flatnonzero((latest != self._seen).any(axis=1))
        for index in changed.tolist():
            self._covered[index].add(*latest[index].tolist())
            self._covered_m[index] = self._covered[index].length
            self._seen[index] = latest[index]
        return self._covered

    @property
    def covered_by_target_m(self) -> NDArray[np.float64]:
        """Length under paint of each target."""
        assert self.covered is self._covered, "which brings the lengths up to date"
        return self._covered_m

    @property
    def fractions(self) -> list[float]:
        """Share of its length under paint of each target."""
        if not self.targets:
            return []
        shares: list[float] = np.minimum(1.0, self.covered_by_target_m / self._lengths).tolist()
        return shares

    @property
    def covered_m(self) -> float:
        """Length of lines under paint."""
        return math.fsum(self.covered_by_target_m)

    @property
    def coverage_pct(self) -> float:
        """Share of the length to be painted that is under paint [%]; 100 when nothing was to be painted."""
        return min(100.0, 100.0 * self.covered_m / self.length_m) if self.length_m > 0.0 else 100.0

    def within_by_target_m(self, limit_m: float) -> list[float]:
        """Compute per target the length over which the middle of paint lies within `limit_m` of it; takes a moment."""
        within, state = [Intervals() for _ in self.targets], p.LedgerState()
        coverage, points, done = self._nothing(state), self.rows(0), 0
        while done < len(points):
            done = p.cover(self._lines, limit_m, points, done, coverage)
            for target, start, end in coverage.stretches[: state.stretches].tolist():
                within[int(target)].add(start, end)
            state.stretches = 0
        for stretch, (start, end) in zip(within, coverage.latest.tolist(), strict=True):
            if start <= end:
                stretch.add(start, end)
        return [stretch.length for stretch in within]

    @property
    def lateral_m(self) -> float:
        """Last painted nozzle position against its line [m]; left positive; 0 before any or far from all."""
        if not (points := self.points):
            return 0.0
        last = self._points[points - 1]
        return float(last[p.POINT_LATERAL]) if last[p.POINT_TARGET] >= 0.0 else 0.0

    def deviation(self) -> Deviation:
        """Return the nozzle against its line at every painted tick."""
        points = self._points[: self.points]
        points = points[points[:, p.POINT_TARGET] >= 0.0]
        return Deviation(points[:, p.POINT_TARGET].astype(np.int64), points[:, p.POINT_LATERAL])

    def rows(self, first: int) -> Floats:
        """Return the points (n, POINT_COLUMNS) from `first` on; a view."""
        return self._points[first : self.points]

    def restore(self, rows: Floats, goes_on_at: tuple[float, float] | None = None) -> None:
        """Enter the rows of another ledger in this empty one; the strokes are complete.

        Only their positions and widths are used: the lines that they belong to are determined anew. `take_marks` then
        returns all of them, because the last marks of the other ledger may have reached nobody.

        Args:
            rows: (n, POINT_COLUMNS) `rows` of the other ledger.
            goes_on_at: Position of the tool [m]: if a thinned stroke can have reached it by then, the stroke continues.
        """
        thins, self._thins = self._thins, False  # they are thinned already
        trace: Floats = np.zeros(body.TRACE_SHAPE)
        begins = rows[:, p.POINT_TARGET] == p.STROKE_BEGINS
        for row, begun in zip(rows[:, [p.POINT_X, p.POINT_Y, p.POINT_WIDTH]], begins.tolist(), strict=True):
            if begun:
                self._state.open = False
            else:
                trace[1:] = row
                self.record(trace)
            trace[0, :2] = row[:2]
        self._thins = thins
        near = goes_on_at is not None and len(rows) > 0 and math.dist(goes_on_at, rows[-1, :2]) <= _GOES_ON_M
        self._state.open = self._state.open and thins and near

    def strokes(self) -> list[PaintStroke]:
        """Return all strokes so far, the open one last."""
        points = self._points[: self.points]
        begins = np.flatnonzero(points[:, p.POINT_TARGET] == p.STROKE_BEGINS).tolist()
        return [self._stroke(points[first:end]) for first, end in pairwise((*begins, len(points)))]

    def strokes_by_target(self) -> list[list[PaintStroke]]:
        """Return per target the stretches of strokes that belong to it."""
        parts: list[list[PaintStroke]] = [[] for _ in self.targets]
        for marks in self.all_marks():
            if marks.target >= 0:
                end = marks.first_index + len(marks.x_m)
                parts[marks.target].append(self._stroke(self._points[marks.first_index : end]))
        return parts

    def drawn_by_target_m(self) -> list[float]:
        """Compute per target the length of the strokes that belong to it, ends and doubled stretches once."""
        drawn = [Intervals() for _ in self.targets]
        for marks in self.all_marks():
            if marks.target >= 0:
                points = self._points[marks.first_index : marks.first_index + len(marks.x_m)]
                xy = points[:, [p.POINT_X, p.POINT_Y]]
                drawn[marks.target].add(*p.extent(xy, self._lines.table[marks.target]))
        return [stretches.length for stretches in drawn]

    def _stroke(self, points: Floats) -> PaintStroke:
        return PaintStroke(points[:, :2], float(points[-1, p.POINT_WIDTH]) * self.spray_width_m)

    def take_marks(self) -> list[Marks]:
        """Return the settled paint since the last call, cut where it passes from one line to another."""
        first, self._taken = self._taken, max(self.settled - 1, 0)
        return self._cut(first) if self.points else []

    def all_marks(self) -> list[Marks]:
        """Return all settled paint, stroke by stroke, cut where it passes from one line to another."""
        return self._cut(0)

    def _cut(self, first: int) -> list[Marks]:
        """Return the marks of the settled points from `first` on; neighbours share their end points."""
        belongs = self._points[first + 1 : self.settled, p.POINT_TARGET]
        if not len(belongs):
            return []
        cuts = [0, *(np.flatnonzero(belongs[1:] != belongs[:-1]) + 1).tolist(), len(belongs)]
        marks: list[Marks] = []
        for begin, end in pairwise(cuts):
            if belongs[begin] != p.STROKE_BEGINS:
                points = self._points[first + begin : first + end + 1]
                width_m = float(points[-1, p.POINT_WIDTH]) * self.spray_width_m
                index = first + begin
                marks.append(Marks(int(belongs[begin]), index, width_m, points[:, p.POINT_X], points[:, p.POINT_Y]))
        return marks
