"""State, other than position, restored after a crash."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Totals(NamedTuple):
    """What has been used up and summed up by the tick of the checkpoint."""

    supplies: tuple[float, float, float, float]
    """As of `World`."""
    errors: tuple[float, ...]
    """(3,) as of `EstimatorError`."""
    points: int
    """Of paint, as of `PaintLedger`."""


class Remains(NamedTuple):
    """The totals, and the paint."""

    totals: Totals
    paint: NDArray[np.float64]
    """(n, 5) rows as of `PaintLedger`; fewer than `totals.points` if the rest was lost."""
