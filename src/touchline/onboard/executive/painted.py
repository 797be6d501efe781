"""Estimated paint: the stretches on which the robot's valve was open, by its own progress along its path.

No sensor observes the paint. A stretch of the path counts from where the first drop falls to where the last one does,
by the valve's nominal delays, whatever really came out of the nozzle and wherever the robot really was. A segment's
share is of its path; among the segments each counts by the length of its line, which a nozzle beside the axle draws
longer or shorter than the path.
"""

from __future__ import annotations

import copy
import math
from bisect import bisect_right
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.intervals import Intervals
from touchline.onboard.interface import PaintBelief
from touchline.onboard.trajectory.trajectory import LoadedTrajectory
from touchline.schemas.messages import Actuation
from touchline.schemas.vehicles import Vehicle

SPILL_M: Final = 0.1
"""Length below which paint on a mostly free segment is the end of its neighbour's paint."""
END_TOLERANCE_M: Final = 0.01
"""Distance within which paint begins or ends where the plan lets it: nothing shorter is owed."""


class _Piece(NamedTuple):
    """Stretch of the path on which paint is to fall, all of it on one segment."""

    start_m: float
    end_m: float
    line: int
    stretch: float
    """Length of the line that the nozzle draws over that of the path."""


class Painted:
    """The stretches of the sprayed segments that count as painted; a stretch painted twice counts once.

    Attributes:
        ids: Ids of the sprayed segments, in path order.
    """

    def __init__(self, plan: LoadedTrajectory, vehicle: Vehicle) -> None:
        """Begin with nothing painted."""
        self._runs = _falling(plan, vehicle)
        self._pieces: list[_Piece] = []
        lines: dict[str, int] = {}
        self._cut(plan, _stretches(plan, vehicle), lines)
        self.ids = tuple(lines)
        self._starts = [piece.start_m for piece in self._pieces]
        self._ends = [piece.end_m for piece in self._pieces]
        self._lengths: NDArray[np.float64] = np.zeros(len(lines))
        drawn_m: NDArray[np.float64] = np.zeros(len(lines))
        for piece in self._pieces:
            self._lengths[piece.line] += piece.end_m - piece.start_m
            drawn_m[piece.line] += piece.stretch * (piece.end_m - piece.start_m)
        self._percents = 100.0 * drawn_m / (math.fsum(drawn_m) or 1.0)
        self._covered = [Intervals() for _ in lines]
        self._covered_m: NDArray[np.float64] = np.zeros(len(lines))

    def _cut(self, plan: LoadedTrajectory, stretches: NDArray[np.float64], lines: dict[str, int]) -> None:
        """Fill in the pieces, and number the ids of their segments."""
        starts, lengths = plan.path[:, 5], plan.path[:, 4]
        for from_m, to_m in self._runs:
            row = max(int(np.searchsorted(starts, from_m, side="right")) - 1, 0)
            while row < len(starts) and starts[row] < to_m:
                start_m, end_m = max(from_m, float(starts[row])), min(to_m, float(starts[row] + lengths[row]))
                if end_m - start_m > min(0.5 * float(lengths[row]), SPILL_M):
                    line = lines.setdefault(plan.ids[row], len(lines))
                    self._pieces.append(_Piece(start_m, end_m, line, float(stretches[row])))
                row += 1

    def add(self, from_m: float, to_m: float) -> None:
        """Count the path between two arc lengths as painted.

        Args:
            from_m: Arc length at which the stretch begins.
            to_m: Arc length at which it ends; nothing is counted if it is not beyond `from_m`.
        """
        for piece in self._parts(from_m, to_m):
            self._covered[piece.line].add(piece.start_m, piece.end_m)
            self._covered_m[piece.line] = self._covered[piece.line].length

    def restore(self, to_m: float) -> None:
        """Count everything that the plan sprays up to a place as painted, as another process recorded it.

        A checkpoint gives the place from which paint is owed, and the path is driven in order. Stretches before that
        place that the other process knew it had missed are not in the checkpoint and are lost.
        """
        for from_m, end_m in self._runs:
            if from_m < to_m:
                self.add(from_m, min(end_m, to_m))

    def belief(self, from_m: float = math.inf, to_m: float = -math.inf) -> PaintBelief:
        """Return the paint, including what the open valve is painting.

        Args:
            from_m: Arc length at which the paint of the open valve begins.
            to_m: Arc length at which it ends.
        """
        covered_m, falling = self._covered_m.copy(), dict[int, Intervals]()
        for piece in self._parts(from_m, to_m):
            covered = falling.setdefault(piece.line, copy.deepcopy(self._covered[piece.line]))
            covered.add(piece.start_m, piece.end_m)
            covered_m[piece.line] = covered.length
        shares = np.minimum(1.0, covered_m / self._lengths)
        coverage_pct = min(100.0, math.fsum(self._percents * shares)) if self.ids else 100.0
        return PaintBelief(self.ids, shares.tolist(), coverage_pct)

    def _parts(self, from_m: float, to_m: float) -> list[_Piece]:
        """Return the parts of the pieces that a stretch covers."""
        from_m, to_m = self._at_plan(from_m, 0), self._at_plan(to_m, 1)
        if from_m >= to_m:
            return []
        first, last = bisect_right(self._ends, from_m), bisect_right(self._starts, to_m)
        return [
            piece._replace(start_m=max(from_m, piece.start_m), end_m=min(to_m, piece.end_m))
            for piece in self._pieces[first:last]
            if piece.start_m < to_m
        ]

    def _at_plan(self, arc_length_m: float, end: int) -> float:
        """Return the planned place where paint begins (0) or ends (1), if that is near; otherwise the place itself."""
        index = bisect_right(self._runs, arc_length_m + END_TOLERANCE_M, key=lambda run: run[end]) - 1
        planned_m = self._runs[index][end] if index >= 0 else -math.inf
        return planned_m if abs(planned_m - arc_length_m) <= END_TOLERANCE_M else arc_length_m


def _stretches(plan: LoadedTrajectory, vehicle: Vehicle) -> NDArray[np.float64]:
    """Return the speed of the nozzle over that of the robot, for each segment of the path."""
    x_m, y_m = vehicle.tool.point_m
    curvature_1pm = plan.path[:, 3] * plan.path[:, 6]
    return np.hypot(1.0 - curvature_1pm * y_m, curvature_1pm * x_m)


def _falling(plan: LoadedTrajectory, vehicle: Vehicle) -> list[tuple[float, float]]:
    """Return the stretches on which paint is to fall, from → to, if the robot drives as fast as planned."""
    runs: list[tuple[float, float]] = []
    opened_m: float | None = None
    for switch_m, mask in zip([*plan.switch_m, plan.total_length_m], [*plan.actuation, Actuation.NONE], strict=True):
        sprays = bool(mask & Actuation.VALVE)
        if sprays and opened_m is None:
            opened_m = switch_m + plan.speed_at(switch_m) * vehicle.tool.opens_s
        elif not sprays and opened_m is not None:
            ends_m = switch_m + plan.speed_at(switch_m) * vehicle.tool.closes_s
            if ends_m > opened_m:
                runs.append((opened_m, min(ends_m, plan.total_length_m)))
            opened_m = None
    return runs
