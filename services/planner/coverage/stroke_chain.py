"""Coverage plan under construction: strokes in order, the transitions between them, and what they cover."""

from collections.abc import Iterable
from typing import NamedTuple

from touchline.services.planner.coverage.cover_stroke import CoverStroke
from touchline.services.planner.coverage.coverage_raster import RasterState
from touchline.services.planner.coverage.stroke_transition import StrokeTransition, TransitionFinder
from touchline.services.planner.geometry.clothoid import PiecePath


class ChainState(NamedTuple):
    """Snapshot of a chain and of what it covers."""

    strokes: list[CoverStroke]
    transitions: list[StrokeTransition]
    counts: RasterState


class StrokeChain:
    """Strokes in driving order, linked by transitions.

    Attributes:
        strokes: Strokes in order.
        transitions: From each stroke to the next.
        finder: Finds transitions.
    """

    def __init__(self, finder: TransitionFinder) -> None:
        """Create an empty chain."""
        self.strokes: list[CoverStroke] = []
        self.transitions: list[StrokeTransition] = []
        self.finder = finder
        self._expected: dict[CoverStroke, list[PiecePath]] = {}

    def expect(self, stroke: CoverStroke, paths: list[PiecePath]) -> None:
        """Count in advance, approximately, what a stroke to come and the path to it will cover."""
        self._expected.setdefault(stroke, []).extend(paths)
        for path in paths:
            self.finder.covered.add(path)

    def forget(self) -> None:
        """Discount all expected strokes."""
        for stroke in [*self._expected]:
            self.forget_of(stroke)

    def forget_of(self, stroke: CoverStroke) -> None:
        """Discount an expected stroke."""
        for path in self._expected.pop(stroke, []):
            self.finder.covered.take(path)

    def append(self, stroke: CoverStroke) -> bool:
        """Append a stroke; false if no transition leads to it."""
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
            self.transitions.append(join)
            self.finder.covered.add(join.path)
            self._count(last + 1, 1)
        self._count(last, 1)
        return join is not None

    def append_over(self, stroke: CoverStroke, vias: Iterable[CoverStroke]) -> bool:
        """Append a stroke, over one of some short ones if no transition leads to it directly."""
        if self.append(stroke):
            return True
        before = self.state
        for via in vias:
            if self.append(via) and self.append(stroke):
                return True
            self.restore(before)
        return False

    def rejoin(self, k: int, missed_most_m2: float | None = None) -> None:
        """Replace the transition from stroke `k` to the next, if there is a better one by now.

        Better means a better score; or, with `missed_most_m2`, quicker and with no more than that missed.
        """
        old, missed_m2 = self.transitions[k], self.finder.covered.missed_m2
        self._lift(k)
        new = self._best(k, self.strokes[k], self.strokes[k + 1], self._following(k))
        if new is None or new == old:
            self._put(k, old)
            return
        seconds = self.seconds
        self._put(k, new)
        if missed_most_m2 is None:
            better = self.score_s < seconds + self.finder.seconds_per_m2 * missed_m2
        else:
            better = self.seconds < seconds and self.finder.covered.missed_m2 <= missed_most_m2
        if not better:
            self._lift(k)
            self._put(k, old)

    def _lift(self, k: int) -> None:
        """Discount stroke `k`, the next one, and the transition between them."""
        self._count(k, -1)
        self._count(k + 1, -1)
        self.finder.covered.take(self.transitions[k].path)

    def _put(self, k: int, join: StrokeTransition) -> None:
        """Set the transition from stroke `k` to the next, and count all three."""
        self.transitions[k] = join
        self.finder.covered.add(join.path)
        self._count(k, 1)
        self._count(k + 1, 1)

    def _following(self, k: int) -> StrokeTransition | None:
        """Transition by which the stroke after stroke `k` is left."""
        return self.transitions[k + 1] if k + 1 < len(self.transitions) else None

    @property
    def score_s(self) -> float:
        """Seconds for the whole chain plus the price of what is missed."""
        return self.seconds + self.finder.seconds_per_m2 * self.finder.covered.missed_m2

    def insert(self, k: int, stroke: CoverStroke) -> bool:
        """Insert a stroke after stroke `k`; false, with the chain unchanged, if transitions are missing."""
        if k == len(self.transitions):
            return self.append(stroke)
        old, next_stroke, ended = self.transitions[k], self.strokes[k + 1], self._following(k)
        self._lift(k)
        there = self._best(k, self.strokes[k], stroke)
        if there is None:
            self._put(k, old)
            return False
        self.strokes.insert(k + 1, stroke)
        self.transitions[k] = there
        self.finder.covered.add(there.path)
        self._count(k, 1)
        onward = self._best(k + 1, stroke, next_stroke, ended)
        if onward is None:
            self._count(k, -1)
            self.finder.covered.take(there.path)
            del self.strokes[k + 1]
            self._put(k, old)
            return False
        self.transitions.insert(k + 1, onward)
        self._put(k + 1, onward)
        return True

    @property
    def state(self) -> ChainState:
        """Snapshot for `restore`."""
        return ChainState([*self.strokes], [*self.transitions], self.finder.covered.counts)

    def restore(self, state: ChainState) -> None:
        """Return to a snapshot."""
        self.strokes, self.transitions = [*state.strokes], [*state.transitions]
        self.finder.covered.count_as(state.counts)

    def clear(self) -> None:
        """Remove all strokes and their coverage."""
        self.strokes, self.transitions = [], []
        self.finder.covered.clear()

    @property
    def seconds(self) -> float:
        """Seconds for the whole chain from rest to rest."""
        pieces = [p for worked, others in self.paths() for path in (worked, *others) if path for p in path.pieces]
        return self.finder.space.machine.seconds(pieces)

    def _best(
        self, k: int, first: CoverStroke, last: CoverStroke, following: StrokeTransition | None = None
    ) -> StrokeTransition | None:
        """Best transition from stroke `k`, the next one left by `following`; both strokes must be discounted."""
        begun = self.transitions[k - 1].arrive_m if k else 0.0
        ended = following.depart_m if following else last.length_m
        left, right = self.finder.zones(first, last, begun, ended)
        kept = [first.part(self._begin(k), left)] if left > self._begin(k) else []
        final = following.leave_m if following else last.length_m
        kept += [last.part(right, final)] if final > right else []
        for path in kept:
            self.finder.covered.add(path)
        join = self.finder.best(first, last, begun, ended)
        for path in kept:
            self.finder.covered.take(path)
        return join

    def _begin(self, k: int) -> float:
        return self.transitions[k - 1].begin_m if k else 0.0

    def _count(self, k: int, change: int) -> None:
        """Count, or discount, the driven part of a stroke."""
        end = self.transitions[k].leave_m if k < len(self.transitions) else self.strokes[k].length_m
        if end > self._begin(k):
            self.finder.covered.add(self.strokes[k].part(self._begin(k), end), change)

    def paths(self) -> list[tuple[PiecePath | None, list[PiecePath]]]:
        """Driven paths by stroke: its worked part, then the transition to the next and a path back on that."""
        found = []
        for k, stroke in enumerate(self.strokes):
            join = self.transitions[k] if k < len(self.transitions) else None
            end = join.leave_m if join else stroke.length_m
            worked = stroke.part(self._begin(k), end) if end > self._begin(k) else None
            driven = [join.path] if join else []
            if join and join.begin_m < join.arrive_m:
                driven.append(self.strokes[k + 1].part(join.arrive_m, join.begin_m))
            found.append((worked, [path for path in driven if path.moves]))
        return found
