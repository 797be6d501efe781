"""Tests of whether a filter is consistent, by its innovations alone: their size, and whether they are white.

Innovations of a filter whose assumptions hold are independent, normally distributed, and as large as it says
(R. K. Mehra, "On the identification of variances and adaptive Kalman filtering", IEEE Trans. Automatic Control 15(2),
1970). Here they are given whitened: each number has mean 0 and variance 1 then.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

Floats = NDArray[np.float64]

LEVEL: Final = 0.999
"""Share of consistent filters that pass a test."""
CORRELATED: Final = 0.1
"""Correlation of successive innovations from which they are called correlated, if chance does not explain it."""
LEAST: Final = 100
"""Fewest innovations that are tested."""
LAGS: Final = 20
"""Number of lags of the Ljung–Box test."""


class Whiteness(NamedTuple):
    """Correlation of innovations over time.

    Attributes:
        lag_1: Correlation of successive ones, mean over the axes.
        lag_1_most: Largest magnitude of it that chance explains.
        ljung_box: Ljung–Box statistic over all axes.
        ljung_box_most: Largest value of it that chance explains.
    """

    lag_1: float
    lag_1_most: float
    ljung_box: float
    ljung_box_most: float

    @property
    def found(self) -> bool:
        """True if the innovations are correlated, so that the filter is less certain than it says."""
        return abs(self.lag_1) > max(self.lag_1_most, CORRELATED)


def nis_bounds(count: int, dof: int, level: float = LEVEL) -> tuple[float, float]:
    """Return the range in which the mean NIS of a consistent filter lies.

    Args:
        count: Number of innovations.
        dof: Numbers in each of them.
        level: Probability with which it does.
    """
    tail = 0.5 * (1.0 - level)
    law = stats.chi2(count * dof)
    return float(law.ppf(tail)) / count, float(law.ppf(1.0 - tail)) / count


def normal_nis(nis: Floats, dof: float) -> Floats:
    """Return the NIS of fixes as if their errors were normal: χ² with 2 degrees of freedom if they are as assumed.

    Args:
        nis: (n,) NIS of fixes whose errors are taken to have a bivariate Student-t distribution.
        dof: ν, its degrees of freedom. A share (1 + NIS/(ν − 2))^(−ν/2) of them is larger; of χ², exp(−NIS/2) is.
    """
    return dof * np.log1p(nis / (dof - 2.0))


def whiteness(white: Floats) -> Whiteness:
    """Return how far innovations are correlated over time, by their ranks: a few wild ones decide nothing.

    Args:
        white: (n, k) whitened innovations, n > `LAGS` + 1. Each axis is replaced by the normal scores of its ranks.
    """
    n, axes = white.shape
    scores = stats.norm.ppf(stats.rankdata(white, axis=0) / (n + 1))
    scores -= scores.mean(axis=0)
    power = (scores**2).sum(axis=0)
    r = np.array([(scores[lag:] * scores[: n - lag]).sum(axis=0) / power for lag in range(1, LAGS + 1)])
    lags = np.arange(1, LAGS + 1)[:, None]
    box = n * (n + 2) * float((r**2 / (n - lags)).sum())
    most = float(stats.norm.ppf(1.0 - 0.5 * (1.0 - LEVEL))) / math.sqrt(n * axes)
    return Whiteness(float(r[0].mean()), most, box, float(stats.chi2.ppf(LEVEL, LAGS * axes)))


def fixes_whiteness(white: Floats) -> Whiteness | None:
    """Return how far the innovations of a run's fixes are correlated over time; None if there are too few.

    Args:
        white: (ticks, WHITE_COLUMNS) of an `EstimatorRun`.
    """
    fixes = white[:, 3:5]
    fixes = fixes[np.isfinite(fixes).all(axis=1)]
    return whiteness(fixes) if len(fixes) >= LEAST else None
