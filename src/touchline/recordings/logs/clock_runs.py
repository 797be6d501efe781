"""Segmentation of stamps where a clock was set, as opposed to messages that were merely overtaken by others.

Where stamps step back, the messages before and behind the step overlap in time. A clock that was set back passes
through the overlap twice: it holds twice as many messages as the stream's rate allows, however short it is. Messages
that were overtaken fill each other's gaps, or are one or two.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.recordings.logs.log_table import Floats

AHEAD_S: Final = 6 * 3600.0
"""A larger step ahead means that the clock was set."""
_FEW: Final = 2  # fewer messages do not prove that a clock was set
_SHORT: Final = 5  # overlaps of no more messages are measured by the usual step, not by the mean
_STRAY_S, _STRAY_PERIODS = 1.0, 20.0  # a few messages further off than both are strays
_EXCESS: Final = 0.5  # of the smaller side of an overlap
_REGULAR: Final = 0.1  # of the period: steps of a regular stream differ by no more
_NEAR: Final = 20  # messages round about that tell whether a stream is regular
_DISORDER: Final = 0.1  # share of backward steps above which blocks of messages are looked at, not each of them
_SET_AT_MOST, _FEW_RUNS = 0.1, 4  # limits of plausible settings of a clock: beyond them the stamps are in no order
_BLOCK: Final = 16
_LEAST_BLOCKS: Final = 8
_SCANNED: Final = 100

Indices = NDArray[np.int64]


def clock_runs(time_s: Floats) -> tuple[list[Indices], Indices]:
    """Return indices of the runs of one clock, in the order of the log, and of single messages that belong to none.

    Args:
        time_s: (n,) finite stamps in the order of the log.
    """
    if _disorder(time_s) <= _DISORDER or len(time_s) < _BLOCK * _LEAST_BLOCKS:
        return _found(time_s)
    blocks = np.array_split(np.arange(len(time_s)), len(time_s) // _BLOCK)
    medians = np.array([np.median(time_s[block]) for block in blocks])
    if _disorder(medians) > _DISORDER:
        return [np.arange(len(time_s))], np.zeros(0, np.int64)
    runs, strays = _found(medians)
    return [np.concatenate([blocks[i] for i in run]) for run in runs], np.concatenate(
        [np.zeros(0, np.int64), *(blocks[i] for i in strays)]
    )


def _disorder(time_s: Floats) -> float:
    """Return the share of steps that go back."""
    return float((np.diff(time_s) < 0.0).mean()) if len(time_s) > 1 else 0.0


def _found(time_s: Floats) -> tuple[list[Indices], Indices]:
    """Return runs and strays; one run if the stamps are in no order, so that every message would be in another."""
    runs, strays = _Search(time_s).found()
    if len(runs) + len(strays) > max(_SET_AT_MOST * len(time_s), _FEW_RUNS):
        return [np.arange(len(time_s))], np.zeros(0, np.int64)
    return runs, strays


@dataclass
class _Search:
    """Single pass through the stamps.

    Attributes:
        time_s: (n,) stamps.
        kept: Indices in the current run.
        highest: For each of them, the largest stamp up to it.
    """

    time_s: Floats
    kept: list[int] = field(default_factory=list)
    highest: list[float] = field(default_factory=list)
    runs: list[list[int]] = field(default_factory=list)
    strays: list[int] = field(default_factory=list)

    def found(self) -> tuple[list[Indices], Indices]:
        steps = np.abs(np.diff(self.time_s))
        self._period_s = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 1.0
        at, n = 0, len(self.time_s)
        while at < n:
            at = self._taken(at)
        self.runs.append(self.kept)
        self._join()
        return [np.array(run, dtype=np.int64) for run in self.runs], np.array(sorted(self.strays), dtype=np.int64)

    def _taken(self, at: int) -> int:
        """Take the message at an index; return the next index to look at."""
        stamp = float(self.time_s[at])
        if not self.kept:
            self._keep(at)
            return at + 1
        latest = self.highest[-1]
        if stamp >= latest:
            if stamp - latest > AHEAD_S:
                self._cut()
            self._keep(at)
            return at + 1
        first = int(np.searchsorted(self.highest, stamp, side="left"))
        before = [i for i in self.kept[first:] if self.time_s[i] >= stamp]
        end = self._end_of_late(at, latest, 2 * len(before) + _SCANNED)
        if self._set_back(before, at, end):
            self._cut()
        elif latest - stamp > max(_STRAY_S, _STRAY_PERIODS * self._period_s):
            if end - at <= min(len(before), _FEW):
                self.strays += range(at, end)
                return end
            if len(before) <= _FEW:
                self._drop(before, first)
                return at
            if latest - stamp > AHEAD_S:
                self._cut()
        self._keep(at)
        return at + 1

    def _end_of_late(self, at: int, latest: float, most: int) -> int:
        """Return the index after the messages from here on that are between this one and the latest before."""
        some = self.time_s[at : at + most]
        beyond = np.flatnonzero((some > latest) | (some < some[0]))
        return at + int(beyond[0]) if len(beyond) else at + len(some)

    def _set_back(self, before: list[int], at: int, end: int) -> bool:
        """Return whether the overlap before and after a step back is passed through twice."""
        behind = self.time_s[at:end]
        few = min(len(before), len(behind))
        if few < _FEW:
            return abs(len(before) - len(behind)) <= 1 and self._goes_on_regularly(before[0], at, end)
        low_s, high_s = float(behind[0]), min(float(self.time_s[before].max()), float(behind.max()))
        held = int((self.time_s[before] <= high_s).sum()) + int((behind <= high_s).sum())
        return held - ((high_s - low_s) / self._period_near(before, at, end) + 1.0) >= _EXCESS * few

    def _period_near(self, before: list[int], at: int, end: int) -> float:
        """Return the period near an overlap, as it were without disorder."""
        first = before[0]
        sides = np.concatenate([np.diff(np.sort(self.time_s[before])), np.diff(np.sort(self.time_s[at:end]))])
        near = [np.sort(side) for side in (self.time_s[max(first - _NEAR, 0) : first], self.time_s[end : end + _NEAR])]
        around = np.concatenate([np.diff(side) for side in near])
        found = [float(steps.mean()) for steps in (sides, around) if len(steps)]
        if min(len(before), end - at) <= _SHORT:
            found.append(float(np.median(np.concatenate([sides, around]))))
        return min((period_s for period_s in found if period_s > 0.0), default=self._period_s)

    def _goes_on_regularly(self, first: int, at: int, end: int) -> bool:
        """Return whether the stream has one step back and is regular around it, which no late message allows."""
        around = np.diff(self.time_s[max(first - _NEAR, 0) : end + _NEAR])
        others = np.delete(around, at - 1 - max(first - _NEAR, 0))
        if len(others) < _NEAR:
            return False
        period_s = float(np.median(others))
        return period_s > 0.0 and bool((np.abs(others - period_s) <= _REGULAR * period_s).all())

    def _keep(self, at: int) -> None:
        stamp = float(self.time_s[at])
        self.kept.append(at)
        self.highest.append(max(stamp, self.highest[-1]) if self.highest else stamp)

    def _drop(self, early: list[int], first: int) -> None:
        """Drop a few messages that are far ahead of all that follows, the first of them the first-th kept."""
        self.strays += early
        again = [i for i in self.kept[first:] if i not in early]
        del self.kept[first:], self.highest[first:]
        if not self.kept and self.runs:  # a step ahead to them looked like a setting of the clock
            again = self.runs.pop() + again
        for i in again:
            self._keep(i)

    def _cut(self) -> None:
        self.runs.append(self.kept)
        self.kept, self.highest = [], []

    def _join(self) -> None:
        """Treat short runs far off as strays if the run behind them continues the one before them."""
        at = 1
        while at < len(self.runs) - 1:
            before, between, behind = self.runs[at - 1 : at + 2]
            step_s = float(self.time_s[behind[0]] - self.time_s[before].max())
            if len(between) <= _FEW and 0.0 <= step_s <= AHEAD_S:
                self.strays += between
                self.runs[at - 1 : at + 2] = [before + behind]
            else:
                at += 1
