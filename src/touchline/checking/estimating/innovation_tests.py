"""Test of whether a filter is consistent, by its innovations alone.

Innovations of a filter whose assumptions hold are independent of each other (R. K. Mehra, "On the identification of
variances and adaptive Kalman filtering", IEEE Trans. Automatic Control 15(2), 1970). Here they are given whitened: each
number has mean 0 and variance 1 then. Of a receiver with bursts, which correlate successive ones, those farther apart
are compared (`Estimator.fix_lag`).
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

Floats = NDArray[np.float64]

LEVEL: Final = 0.999
"""Share of consistent filters that pass a test."""
CORRELATED: Final = 0.12
"""Correlation of innovations from which they are called correlated, if chance does not explain it. In 20 emulated
tennis jobs with right files it is 0.09 at most."""
LEAST: Final = 100
"""Fewest innovations that are tested."""


class Whiteness(NamedTuple):
    """Correlation of innovations over time.

    Attributes:
        correlation: Correlation of those that are some fixes apart, mean over the axes.
        by_chance: Largest magnitude of it that chance explains.
    """

    correlation: float
    by_chance: float

    @property
    def found(self) -> bool:
        """True if the innovations are correlated, so that the filter is less certain than it says."""
        return abs(self.correlation) > max(self.by_chance, CORRELATED)


def whiteness(white: Floats, lag: int) -> Whiteness:
    """Return how far innovations `lag` apart are correlated, by their ranks: a few wild ones decide nothing.

    Args:
        white: (n, k) whitened innovations. Each axis is replaced by the normal scores of its ranks.
        lag: Number of innovations.
    """
    n, axes = white.shape
    ranks = white.argsort(axis=0, kind="stable").argsort(axis=0) + 1
    scores = ndtri(ranks / (n + 1))
    r = (scores[lag:] * scores[:-lag]).sum(axis=0) / (scores**2).sum(axis=0)
    most = float(ndtri(1.0 - 0.5 * (1.0 - LEVEL))) / math.sqrt(n * axes)
    return Whiteness(float(r.mean()), most)


def fixes_whiteness(white: Floats, lag: int) -> Whiteness | None:
    """Return how far the innovations of a run's fixes are correlated over time; None if there are too few.

    Args:
        white: (ticks, WHITE_COLUMNS) of an `EstimatorRun`.
        lag: Number of fixes, that of the run.
    """
    fixes = white[:, :2]
    fixes = fixes[np.isfinite(fixes).all(axis=1)]
    return whiteness(fixes, lag) if len(fixes) >= LEAST else None
