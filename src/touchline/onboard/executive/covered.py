"""Estimated ground covered with a tool that works wherever it goes: the swaths that the robot has driven.

No sensor observes the ground. The path is driven in order, so all of it counts up to the robot's own progress.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from touchline.onboard.interface import PaintBelief
from touchline.onboard.trajectory.trajectory import LoadedTrajectory
from touchline.schemas.swath_ids import area_id_of

_START: Final = 5  # columns of `cut_path`
_LENGTH: Final = 4


class Covered:
    """The swaths of areas along a path; all segments, if none is a swath."""

    def __init__(self, plan: LoadedTrajectory) -> None:
        """Find the swaths of a plan."""
        driven = np.flatnonzero(plan.path[:, _LENGTH]).tolist()
        swaths = [row for row in driven if area_id_of(plan.ids[row])] or driven
        numbers: dict[str, int] = {}
        self._swath = np.array([numbers.setdefault(plan.ids[row], len(numbers)) for row in swaths])
        self._ids = tuple(numbers)
        self._start_m, self._rows_m = plan.path[swaths, _START], plan.path[swaths, _LENGTH]
        self._length_m = np.bincount(self._swath, self._rows_m)
        self._whole_m = self._length_m.sum()

    def belief(self, arc_length_m: float) -> PaintBelief:
        """Return the covered swaths at an arc length of the robot."""
        driven_m = np.bincount(self._swath, np.minimum(np.maximum(arc_length_m - self._start_m, 0.0), self._rows_m))
        shares: list[float] = (driven_m / self._length_m).tolist()
        return PaintBelief(self._ids, shares, float(100.0 * driven_m.sum() / self._whole_m))
