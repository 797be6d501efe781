"""A plan as it grows: strokes in order, the ways between them, and what they cover."""

from touchline.services.planner.coverage.cover_stroke import CoverStroke
from touchline.services.planner.coverage.stroke_join import Joiner, StrokeJoin
from touchline.services.planner.geometry.clothoid import PiecePath


class StrokeChain:
    """Strokes in driving order.

    Attributes:
        strokes: In order.
        joins: From each stroke to the next.
        joiner: Finds ways.
    """

    def __init__(self, joiner: Joiner) -> None:
        """Empty."""
        self.strokes: list[CoverStroke] = []
        self.joins: list[StrokeJoin] = []
        self.joiner = joiner
        self._expected: dict[CoverStroke, PiecePath] = {}

    def expect(self, stroke: CoverStroke, leave_m: float, join_m: float) -> None:
        """Count a stroke that will come, but for what turns take before its end and behind its beginning."""
        half = 0.5 * stroke.length_m
        self._expected[stroke] = stroke.part(min(join_m, half), stroke.length_m - min(leave_m, half))
        self.joiner.covered.add(self._expected[stroke])

    def forget(self) -> None:
        """Expect nothing more."""
        for path in self._expected.values():
            self.joiner.covered.take(path)
        self._expected.clear()

    def append(self, stroke: CoverStroke) -> bool:
        """Carry on with a stroke; false if there is no way to it."""
        if stroke in self._expected:
            self.joiner.covered.take(self._expected.pop(stroke))
        if not self.strokes:
            self.strokes.append(stroke)
            self._count(0, 1)
            return True
        last = len(self.strokes) - 1
        self._count(last, -1)
        join = self._best(last, self.strokes[last], stroke)
        if join:
            self.strokes.append(stroke)
            self.joins.append(join)
            self.joiner.covered.add(join.way)
            self._count(last + 1, 1)
        self._count(last, 1)
        return join is not None

    def rejoin(self, k: int) -> float:
        """Look for a better way from stroke `k` to the next, now that more is known; seconds less its worth in area."""
        self._count(k, -1)
        self._count(k + 1, -1)
        self.joiner.covered.take(self.joins[k].way)
        old = self.joins[k]
        self.joins[k] = self._best(k, self.strokes[k], self.strokes[k + 1]) or old
        self.joiner.covered.add(self.joins[k].way)
        self._count(k, 1)
        self._count(k + 1, 1)
        return self.joins[k].seconds - old.seconds

    def _best(self, k: int, first: CoverStroke, last: CoverStroke) -> StrokeJoin | None:
        """The best way from stroke `k` on; neither it nor the next may be counted."""
        begun = self.joins[k - 1].arrive_m if k else 0.0
        ended = self.joins[k + 1].depart_m if k + 1 < len(self.joins) else last.length_m
        left, right = self.joiner.zones(first, last, begun, ended)
        kept = [first.part(self._begin(k), left)] if left > self._begin(k) else []
        final = self.joins[k + 1].leave_m if k + 1 < len(self.joins) else last.length_m
        kept += [last.part(right, final)] if final > right else []
        for path in kept:
            self.joiner.covered.add(path)
        join = self.joiner.best(first, last, begun, ended)
        for path in kept:
            self.joiner.covered.take(path)
        return join

    def _begin(self, k: int) -> float:
        return self.joins[k - 1].begin_m if k else 0.0

    def _count(self, k: int, change: int) -> None:
        """Count what is driven of a stroke, or count it no more."""
        end = self.joins[k].leave_m if k < len(self.joins) else self.strokes[k].length_m
        if end > self._begin(k):
            self.joiner.covered.add(self.strokes[k].part(self._begin(k), end), change)

    def paths(self) -> list[list[PiecePath]]:
        """What is driven, stroke by stroke: its own stretch, the way to the next, a way back on that."""
        found = []
        for k, stroke in enumerate(self.strokes):
            join = self.joins[k] if k < len(self.joins) else None
            end = join.leave_m if join else stroke.length_m
            parts = [stroke.part(self._begin(k), end)]
            if join:
                after = self.strokes[k + 1]
                parts += [join.way, after.part(join.arrive_m, join.begin_m)]
            found.append([part for part in parts if part.length_m > 0.0])
        return found
