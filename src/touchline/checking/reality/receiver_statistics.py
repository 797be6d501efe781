"""Statistics of a standing receiver: standard deviation, differences at several lags, autocorrelation."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

LAGS_S: Final = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0)
"""Lags of the differences."""
_GAP_S: Final = 1.0


def each_second(fixes: Floats) -> Floats:
    """Return the positions of fixes each second, less their mean; NaN in gaps.

    Args:
        fixes: (k, 3) time [s], east, north [m].

    Returns:
        (s, 2).
    """
    time_s = np.arange(fixes[0, 0], fixes[-1, 0] + 1e-6, 1.0)
    nearest = np.searchsorted(fixes[:, 0], time_s).clip(0, len(fixes) - 1)
    before = np.maximum(nearest - 1, 0)
    nearer = np.abs(fixes[before, 0] - time_s) < np.abs(fixes[nearest, 0] - time_s)
    nearest = np.where(nearer, before, nearest)
    places = fixes[nearest, 1:3].copy()
    places[np.abs(fixes[nearest, 0] - time_s) > 0.5 * _GAP_S] = np.nan
    off: Floats = places - np.nanmean(places, axis=0)
    return off


def difference_m(off: Floats, lag_s: float) -> float:
    """Return the root mean square of differences at a lag, an axis.

    Args:
        off: (s, 2) positions each second.
        lag_s: The lag.
    """
    lag = round(lag_s)
    return float(np.sqrt(np.nanmean((off[lag:] - off[:-lag]) ** 2)))


def autocorrelation(off: Floats, lag_s: float) -> float:
    """Return the correlation of positions at a lag, the mean of both axes.

    Args:
        off: (s, 2) positions each second.
        lag_s: The lag.
    """
    lag = round(lag_s)
    products = np.nanmean(off[lag:] * off[:-lag], axis=0)
    return float((products / np.nanvar(off, axis=0)).mean())


def sigma_m(off: Floats) -> float:
    """Return the standard deviation about the mean, an axis.

    Args:
        off: (s, 2) positions each second.
    """
    return float(np.sqrt(np.nanvar(off, axis=0).mean()))
