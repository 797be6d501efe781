"""The ledger of what was really painted, and how much of what should be painted it covers so far."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from services.robot_sim.paint import projection
from services.robot_sim.paint.intervals import Intervals
from services.robot_sim.paint.targets import Target
from services.robot_sim.world.body import STEPS, TRACE_EAST, TRACE_NORTH


@dataclass
class Stroke:
    """The true nozzle from the opening of the valve to its closing, in the map frame.

    Points lie 10 ms apart, but for the first and the last, which are exact to 1 ms.
    """

    first_index: int
    """Of its first point, in the count of all points of the session."""
    x_m: list[float] = field(default_factory=list)
    y_m: list[float] = field(default_factory=list)
    target: list[int] = field(default_factory=list)
    """For each point after the first: the line that the paint up to it belongs to, −1 for none."""


class Marks(NamedTuple):
    """A stretch of one stroke that belongs to one line."""

    segment_id: str
    first_index: int
    x_m: list[float]
    y_m: list[float]


class Deviation(NamedTuple):
    """The nozzle against its line, once per tick of spraying."""

    target: NDArray[np.int64]
    arc_length_m: NDArray[np.float64]
    lateral_m: NDArray[np.float64]


class PaintLedger:
    """Collects the true paint, tick by tick.

    Args:
        targets: What should be painted.
        line_width_m: Of the lines: paint counts within half of it.
        spray_width_m: Of the paint.

    Attributes:
        ids: Of the targets.
        strokes: All strokes so far, the open one last.
        covered: Per target, the stretches over which paint lies.
    """

    def __init__(self, targets: Sequence[Target], line_width_m: float, spray_width_m: float) -> None:
        """See the class."""
        self.targets = list(targets)
        self.ids = tuple(target.id for target in self.targets)
        self.line_width_m, self.spray_width_m = line_width_m, spray_width_m
        self.strokes: list[Stroke] = []
        self.covered = [Intervals() for _ in self.targets]
        self.length_m = sum(target.curve.length_m for target in self.targets)
        self._table = np.array(
            [(c.x_m, c.y_m, c.heading_rad, c.curvature_1pm, c.length_m) for _, c in self.targets], dtype=np.float64
        ).reshape(-1, 5)
        self._runs: NDArray[np.float64] = np.zeros(projection.RUN_SHAPE)
        self._hits: NDArray[np.float64] = np.zeros((3 * max(1, len(self.targets)) * STEPS, projection.HIT_COLUMNS))
        self._open = False
        self._points = 0
        self._deviations: list[tuple[float, float, float]] = []
        self._sent = (0, 0)  # stroke and point from which the next batch begins

    def record(self, trace: NDArray[np.float64]) -> None:
        """Enter one tick; `trace` is (STEPS + 1, 3), the world's."""
        runs, hits = projection.mark(self._table, 0.5 * self.line_width_m, trace, self._runs, self._hits)
        if runs == 0:
            self._open = False
            return
        for first, last, target, arc_length, lateral in self._runs[:runs].tolist():
            if first > 0 or not self._open:
                self._begin(trace[int(first)])
            self._append(trace[int(last)], int(target))
            self._open = last == STEPS
            if target >= 0:
                self._deviations.append((target, arc_length, lateral))
        for target, start, end in self._hits[:hits].tolist():
            self.covered[int(target)].add(start, end)

    def _begin(self, row: NDArray[np.float64]) -> None:
        self.strokes.append(Stroke(self._points, [float(row[TRACE_EAST])], [float(row[TRACE_NORTH])]))
        self._points += 1

    def _append(self, row: NDArray[np.float64], target: int) -> None:
        stroke = self.strokes[-1]
        stroke.x_m.append(float(row[TRACE_EAST]))
        stroke.y_m.append(float(row[TRACE_NORTH]))
        stroke.target.append(target)
        self._points += 1

    @property
    def fractions(self) -> list[float]:
        """Per target, the share of its length over which paint lies."""
        return [
            min(1.0, covered.length / target.curve.length_m)
            for covered, target in zip(self.covered, self.targets, strict=True)
        ]

    @property
    def covered_m(self) -> float:
        """Length of lines over which paint lies."""
        return sum(covered.length for covered in self.covered)

    @property
    def coverage_pct(self) -> float:
        """Share of the length to be painted over which paint lies [%]; 100 when nothing was to be painted."""
        return min(100.0, 100.0 * self.covered_m / self.length_m) if self.length_m > 0.0 else 100.0

    @property
    def lateral_m(self) -> float:
        """The last painted nozzle position against its line [m]; left positive; 0 before any."""
        return self._deviations[-1][2] if self._deviations else 0.0

    def deviation(self) -> Deviation:
        """Every painted tick's nozzle against its line."""
        columns = np.array(self._deviations, dtype=np.float64).reshape(-1, 3)
        return Deviation(columns[:, 0].astype(np.int64), columns[:, 1], columns[:, 2])

    def take_marks(self) -> list[Marks]:
        """The paint since the last call, cut where it passes from one line to another."""
        stroke_index, point = self._sent
        marks: list[Marks] = []
        for index in range(stroke_index, len(self.strokes)):
            marks += self._cut(self.strokes[index], point)
            point = 0
        if self.strokes:
            self._sent = (len(self.strokes) - 1, len(self.strokes[-1].x_m) - 1)
        return marks

    def all_marks(self) -> list[Marks]:
        """Everything painted, stroke by stroke, cut where it passes from one line to another."""
        return [marks for stroke in self.strokes for marks in self._cut(stroke, 0)]

    def _cut(self, stroke: Stroke, first: int) -> list[Marks]:
        """Marks of the points from `first` on; neighbours share their end points."""
        marks: list[Marks] = []
        last = len(stroke.x_m) - 1
        while first < last:
            target, end = stroke.target[first], first + 1
            while end < last and stroke.target[end] == target:
                end += 1
            name = self.targets[target].id if target >= 0 else ""
            span = slice(first, end + 1)
            marks.append(Marks(name, stroke.first_index + first, stroke.x_m[span], stroke.y_m[span]))
            first = end
        return marks
