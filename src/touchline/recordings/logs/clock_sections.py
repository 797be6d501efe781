"""Sections of a log between settings of its clock: all streams use the same one, whatever their rates."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from touchline.recordings.logs.clock_runs import clock_runs
from touchline.recordings.logs.log_table import LogContent


def of_one_clock(content: LogContent) -> LogContent:
    """Return the streams in the section that holds most of them, and a line that reports it."""
    places = {name: table.place for name, table in content.tables.items() if table.place is not None}
    cuts: set[int] = set()
    most = 0
    for name, placed in places.items():
        table = content.tables[name]
        place = placed[np.isfinite(table.time_s)]
        if len(place):
            runs, _ = clock_runs(table.time_s[np.isfinite(table.time_s)])
            cuts.update(int(place[run[0]]) for run in runs[1:])
            most = max(most, len(runs) - 1)
    if not cuts:
        return content
    edges = np.array(sorted(cuts))
    sections = {name: np.searchsorted(edges, place, side="right") for name, place in places.items()}
    chosen = int(np.argmax(sum(_shares(section, len(edges) + 1) for section in sections.values())))
    used = sum(int((section == chosen).sum()) for section in sections.values())
    others = sum(map(len, sections.values())) - used
    note = f"the clock was set {most:,} times: {others:,} messages outside of the longest run are left out"
    cut = {name: content.tables[name].rows(section == chosen) for name, section in sections.items()}
    return LogContent({**content.tables, **cut}, [*content.problems, note])


def _shares(section: NDArray[np.int64], count: int) -> NDArray[np.float64]:
    """Return (count,) the share of a stream's messages in each section."""
    shares: NDArray[np.float64] = np.bincount(section, minlength=count) / max(len(section), 1)
    return shares
