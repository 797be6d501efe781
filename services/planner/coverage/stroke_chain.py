"""A plan as it grows: strokes in order, the ways between them, and what they cover."""

from collections.abc import Iterable
from typing import NamedTuple

from touchline.services.planner.coverage.cover_stroke import CoverStroke
from touchline.services.planner.coverage.stroke_join import Joiner, StrokeJoin
from touchline.services.planner.coverage.stroke_map import MapCounts
from touchline.services.planner.geometry.clothoid import PiecePath


class ChainState(NamedTuple):
    """A chain and what it covers, to come back to."""

    strokes: list[CoverStroke]
    joins: list[StrokeJoin]
    counts: MapCounts


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
        self._expected: dict[CoverStroke, list[PiecePath]] = {}

    def expect(self, stroke: CoverStroke, paths: list[PiecePath]) -> None:
        """Count what a stroke that will come, and the way to it, will cover, about."""
        self._expected.setdefault(stroke, []).extend(paths)
        for path in paths:
            self.joiner.covered.add(path)

    def forget(self) -> None:
        """Expect nothing more."""
        for stroke in [*self._expected]:
            self.forget_of(stroke)

    def forget_of(self, stroke: CoverStroke) -> None:
        """Expect a stroke no more."""
        for path in self._expected.pop(stroke, []):
            self.joiner.covered.take(path)

    def append(self, stroke: CoverStroke) -> bool:
        """Carry on with a stroke; false if there is no way to it."""
        self.forget_of(stroke)
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

    def append_over(self, stroke: CoverStroke, vias: Iterable[CoverStroke]) -> bool:
        """Carry on with a stroke, over one of some short ones if there is no other way."""
        if self.append(stroke):
            return True
        before = self.state
        for via in vias:
            if self.append(via) and self.append(stroke):
                return True
            self.restore(before)
        return False

    def rejoin(self, k: int, missed_most_m2: float | None = None) -> None:
        """Take a better way from stroke `k` to the next, if there is one now that more is known.

        Better is what scores better; or, if so much may be missed, what is quicker and misses no more than that.
        """
        old, missed_m2 = self.joins[k], self.joiner.covered.missed_m2
        self._lift(k)
        new = self._best(k, self.strokes[k], self.strokes[k + 1], self._following(k))
        if new is None or new == old:
            self._put(k, old)
            return
        seconds = self.seconds
        self._put(k, new)
        if missed_most_m2 is None:
            better = self.score_s < seconds + self.joiner.seconds_per_m2 * missed_m2
        else:
            better = self.seconds < seconds and self.joiner.covered.missed_m2 <= missed_most_m2
        if not better:
            self._lift(k)
            self._put(k, old)

    def _lift(self, k: int) -> None:
        """Count the way from stroke `k` to the next no more, nor the two."""
        self._count(k, -1)
        self._count(k + 1, -1)
        self.joiner.covered.take(self.joins[k].way)

    def _put(self, k: int, join: StrokeJoin) -> None:
        """Go from stroke `k` to the next so, where they are not counted."""
        self.joins[k] = join
        self.joiner.covered.add(join.way)
        self._count(k, 1)
        self._count(k + 1, 1)

    def _following(self, k: int) -> StrokeJoin | None:
        """How the stroke behind stroke `k` is left."""
        return self.joins[k + 1] if k + 1 < len(self.joins) else None

    @property
    def score_s(self) -> float:
        """Seconds for the whole chain, and what is missed at what it is worth."""
        return self.seconds + self.joiner.seconds_per_m2 * self.joiner.covered.missed_m2

    def insert(self, k: int, stroke: CoverStroke) -> bool:
        """Drive a stroke between stroke `k` and the next; false, and all as before, if there is no way."""
        if k == len(self.joins):
            return self.append(stroke)
        old, next_stroke, ended = self.joins[k], self.strokes[k + 1], self._following(k)
        self._lift(k)
        there = self._best(k, self.strokes[k], stroke)
        if there is None:
            self._put(k, old)
            return False
        self.strokes.insert(k + 1, stroke)
        self.joins[k] = there
        self.joiner.covered.add(there.way)
        self._count(k, 1)
        onward = self._best(k + 1, stroke, next_stroke, ended)
        if onward is None:
            self._count(k, -1)
            self.joiner.covered.take(there.way)
            del self.strokes[k + 1]
            self._put(k, old)
            return False
        self.joins.insert(k + 1, onward)
        self._put(k + 1, onward)
        return True

    @property
    def state(self) -> ChainState:
        """What `restore` takes."""
        return ChainState([*self.strokes], [*self.joins], self.joiner.covered.counts)

    def restore(self, state: ChainState) -> None:
        """Make everything as it was."""
        self.strokes, self.joins = [*state.strokes], [*state.joins]
        self.joiner.covered.count_as(state.counts)

    def clear(self) -> None:
        """Begin anew: no strokes, nothing covered."""
        self.strokes, self.joins = [], []
        self.joiner.covered.clear()

    @property
    def seconds(self) -> float:
        """For the whole chain, from standstill to standstill."""
        pieces = [p for worked, ways in self.paths() for path in (worked, *ways) if path for p in path.pieces]
        return self.joiner.space.machine.seconds(pieces)

    def _best(
        self, k: int, first: CoverStroke, last: CoverStroke, following: StrokeJoin | None = None
    ) -> StrokeJoin | None:
        """The best way from stroke `k` on, the next one left as `following` says; neither of them may be counted."""
        begun = self.joins[k - 1].arrive_m if k else 0.0
        ended = following.depart_m if following else last.length_m
        left, right = self.joiner.zones(first, last, begun, ended)
        kept = [first.part(self._begin(k), left)] if left > self._begin(k) else []
        final = following.leave_m if following else last.length_m
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

    def paths(self) -> list[tuple[PiecePath | None, list[PiecePath]]]:
        """What is driven, stroke by stroke: what is left of it, the way to the next, and a way back on that."""
        found = []
        for k, stroke in enumerate(self.strokes):
            join = self.joins[k] if k < len(self.joins) else None
            end = join.leave_m if join else stroke.length_m
            worked = stroke.part(self._begin(k), end) if end > self._begin(k) else None
            ways = [join.way] if join else []
            if join and join.begin_m < join.arrive_m:
                ways.append(self.strokes[k + 1].part(join.arrive_m, join.begin_m))
            found.append((worked, [way for way in ways if way.moves]))
        return found
