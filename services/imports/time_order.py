"""Stamps of a log put in order: repetitions, small disorder, and clocks that begin anew."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from touchline.services.imports.log_table import Floats

BACK_S = 60.0
"""A stamp further back than this is of a clock that began anew; less is disorder, and is sorted."""
AHEAD_S = 6 * 3600.0
"""A step further ahead than this is of a clock that was set."""


def in_order(time_s: Floats) -> tuple[NDArray[np.int64], list[str]]:
    """Indices of the messages to use, in the order of their stamps, and what is left out, a line each.

    Of a clock that was set or began anew the longest run is used. Of several messages of one stamp the first is.

    Args:
        time_s: (n,) stamps in the order of the log; NaN where there is none.
    """
    told: list[str] = []
    kept = np.flatnonzero(np.isfinite(time_s))
    if len(kept) < len(time_s):
        told.append(f"{len(time_s) - len(kept):,} messages have no time")
    if not len(kept):
        return kept, told
    times = time_s[kept]
    steps = np.diff(times)
    cuts = np.flatnonzero((steps > AHEAD_S) | (steps < -BACK_S)) + 1
    runs = np.split(np.arange(len(times)), cuts)
    run = max(runs, key=len)
    if len(runs) > 1:
        told.append(
            f"the clock was set {len(cuts):,} times: {len(times) - len(run):,} messages outside of the longest run "
            "are left out"
        )
    times, kept = times[run], kept[run]
    back = int((np.diff(times) < 0).sum())
    if back:
        told.append(f"{back:,} messages are older than the one before, and were sorted")
    order = np.argsort(times, kind="stable")
    times, kept = times[order], kept[order]
    first = np.concatenate(([True], np.diff(times) > 0))
    if not first.all():
        told.append(f"{int((~first).sum()):,} messages repeat a stamp, and are left out")
    return kept[first], told
