"""Scatter and drift of the fixes of a stationary receiver: the figures that data sheets and filters need."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from touchline.checking.estimating.estimator_run import EstimatorRun
from touchline.onboard.estimation.aiding.gnss_aiding import FIX_FIXED

Floats = NDArray[np.float64]

LEAST_S: Final = 120.0
LAG_S: Final = 60.0
_STOOD_M = 0.5  # RTK-fixed positions farther apart than this are those of a moving receiver


def receiver_figures(run: EstimatorRun) -> dict[str, Any] | None:
    """Return figures of RTK-fixed positions of a receiver stationary for two minutes or more, else None.

    It may move before and after. σ per axis about the mean; the step from one second to the next, rms per axis; and the
    autocorrelation at 60 s, each the mean of east and north.
    """
    fixed = standing(run.receiver[run.receiver[:, 4] == FIX_FIXED])
    if len(fixed) < LEAST_S or fixed[-1, 0] - fixed[0, 0] < LEAST_S:
        return None
    places = fixed[:, 1:3]
    time_s = np.arange(fixed[0, 0], fixed[-1, 0], 1.0)
    apart = np.abs(fixed[np.searchsorted(fixed[:, 0], time_s).clip(0, len(fixed) - 1), 0] - time_s)
    places = np.column_stack([np.interp(time_s, fixed[:, 0], axis) for axis in places.T])
    places[apart > 1.0] = np.nan  # a gap
    off = places - np.nanmean(places, axis=0)
    return {
        "fixes": len(fixed),
        "span_s": float(fixed[-1, 0] - fixed[0, 0]),
        "sigma_east_m": float(np.nanstd(off[:, 0])),
        "sigma_north_m": float(np.nanstd(off[:, 1])),
        "step_1s_m": float(np.sqrt(np.nanmean(np.diff(off, axis=0) ** 2))),
        "autocorrelation_60s": _autocorrelation(off, round(LAG_S)),
    }


def standing(fixed: Floats) -> Floats:
    """Return the longest run of fixes near to where most are.

    Args:
        fixed: (k, c) time, east, north [m], and others.
    """
    if not len(fixed):
        return fixed
    near = np.hypot(*(fixed[:, 1:3] - np.median(fixed[:, 1:3], axis=0)).T) <= _STOOD_M
    runs = np.split(np.arange(len(fixed)), np.flatnonzero(np.diff(near)) + 1)
    return fixed[max((run for run in runs if near[run[0]]), key=len, default=np.arange(0))]


def _autocorrelation(off: Floats, lag: int) -> float:
    """Return the mean over both axes."""
    products = np.nanmean(off[lag:] * off[:-lag], axis=0)
    return float((products / np.nanvar(off, axis=0)).mean())
