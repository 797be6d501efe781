"""Sorting of a log's stamps: repetitions, small disorder, and clocks that were set back."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.recordings.logs.clock_runs import clock_runs
from touchline.recordings.logs.log_table import Floats

MOSTLY: Final = 0.9
"""Share of backward steps above which a log has its newest message first."""


def in_order(time_s: Floats) -> tuple[NDArray[np.int64], list[str]]:
    """Return indices of the messages to use, in the order of their stamps, and what is left out, a line each.

    Of a clock that was set back or restarted the longest run is used. Of several messages of one stamp the first is.

    Args:
        time_s: (n,) stamps in the order of the log; NaN where there is none.
    """
    notes: list[str] = []
    kept = np.flatnonzero(np.isfinite(time_s))
    if len(kept) < len(time_s):
        notes.append(f"{len(time_s) - len(kept):,} messages have no time")
    if not len(kept):
        return kept, notes
    if (np.diff(time_s[kept]) < 0.0).sum() > MOSTLY * (len(kept) - 1):
        notes.append("the log has its newest message first, and was turned round")
        kept = kept[::-1]
    runs, strays = clock_runs(time_s[kept])
    run = max(runs, key=len)
    if len(runs) > 1:
        others = sum(map(len, runs)) - len(run)
        notes.append(
            f"the clock was set {len(runs) - 1:,} times: {others:,} messages outside of the longest run are left out"
        )
    if len(strays):
        notes.append(f"{len(strays):,} messages have stamps far from their neighbours', and are left out")
    kept = kept[run]
    times = time_s[kept]
    back = int((np.diff(times) < 0).sum())
    if back:
        notes.append(f"{back:,} messages are older than the one before, and were sorted")
    order = np.argsort(times, kind="stable")
    times, kept = times[order], kept[order]
    first = np.concatenate(([True], np.diff(times) > 0))
    if not first.all():
        notes.append(f"{int((~first).sum()):,} messages repeat a stamp, and are left out")
    return kept[first], notes
