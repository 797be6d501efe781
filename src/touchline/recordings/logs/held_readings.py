"""Readings that a table holds over several rows, since another column of it is faster."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.recordings.logs.log_table import Floats

_HELD: Final = 1.5
"""Rows between two changes, in the median, from which on readings are held; a reading that rests is one of its own
again after this multiple of the usual time."""
_RESTS: Final = 3.0
"""Multiple of the usual time from which on a reading rests. One that is held for twice that time may have come late,
and the robot has driven meanwhile."""


def changes(time_s: Floats, values: Floats) -> NDArray[np.bool_]:
    """Return (n,) which rows are readings of their own, and not the one before again.

    Args:
        time_s: (n,) stamps, increasing.
        values: (n, k) readings.
    """
    own = np.ones(len(values), dtype=bool)
    own[1:] = (values[1:] != values[:-1]).any(axis=1)
    if own.sum() < 3:
        return np.ones_like(own)
    usual_s = float(np.median(np.diff(time_s[own])))
    if usual_s < _HELD * float(np.median(np.diff(time_s))):
        return np.ones_like(own)
    begin = np.maximum.accumulate(np.where(own, np.arange(len(own)), 0))
    since_s = time_s - time_s[begin]
    lasts_s = np.zeros(len(own))
    np.maximum.at(lasts_s, begin, since_s)
    times_held = np.floor(since_s / (_HELD * usual_s))
    own[1:] |= (times_held[1:] > times_held[:-1]) & (lasts_s[begin[1:]] >= _RESTS * usual_s)
    return own


def between_changes(time_s: Floats, column: Floats) -> Floats:
    """Return (n,) a column with held readings interpolated; NaN where there is none.

    Args:
        time_s: (n,) stamps; NaN where there is none.
        column: (n,) readings.
    """
    there = np.flatnonzero(np.isfinite(time_s) & np.isfinite(column))
    times = time_s[there]
    if len(there) < 3 or (np.diff(times) <= 0.0).any():
        return column
    own = changes(times, column[there, None])
    found = column.copy()
    found[there] = np.interp(times, times[own], column[there][own])
    return found
