"""Growing union of intervals, exact at any length."""

from __future__ import annotations

from bisect import bisect_left, bisect_right

from touchline.core.plain_sum import plain_sum


class Intervals:
    """Union of closed intervals of the real line, independent of the order of additions."""

    def __init__(self) -> None:
        """Create an empty set."""
        self._starts: list[float] = []
        self._ends: list[float] = []

    @property
    def length(self) -> float:
        """Total length of the set."""
        return plain_sum(end - start for start, end in zip(self._starts, self._ends, strict=True))

    def add(self, start: float, end: float) -> None:
        """Unite with [`start`, `end`]; `start` ≤ `end`."""
        starts, ends = self._starts, self._ends
        first = bisect_left(ends, start)
        last = bisect_right(starts, end)
        if first < last:
            start, end = min(start, starts[first]), max(end, ends[last - 1])
        starts[first:last], ends[first:last] = [start], [end]

    def spans(self) -> list[tuple[float, float]]:
        """The disjoint intervals, ascending."""
        return list(zip(self._starts, self._ends, strict=True))
