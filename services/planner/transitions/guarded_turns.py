"""Checks of what transition methods of plug-ins return."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from touchline.schemas.plugins import METHODS
from touchline.services.planner.geometry.clothoid import Floats, Ints, PathPose, Piece
from touchline.services.planner.limits import Limits
from touchline.services.planner.plugin_answers import Blame, blaming, called, leading, sound
from touchline.services.planner.steering.method import CurveEnd, TransitionMethod
from touchline.services.planner.transitions.method_choice import Method
from touchline.services.planner.transitions.transitions import Priced, Pricing, Timer, TransitionFamily


def guarded_transitions(method: Method, name: str, limits: Limits) -> TransitionFamily:
    """Create the transitions of a method; what a plug-in's method returns is checked.

    Raises:
        PlanningError: The method has no transitions. The checks raise it, too.
    """
    blame = blaming(METHODS, name)
    if blame is None:
        return method.transitions(limits)
    family = called(blame, method.transitions, limits)
    if not (isinstance(family, TransitionFamily) and family.turns):
        raise blame("it has no transitions")
    turns = tuple(each._replace(method=_GuardedTurns(each.method, blame)) for each in family.turns)
    own = family.pricing
    return replace(family, turns=turns, pricing=own and _GuardedPricing(own, blame))


class _GuardedTurns:
    """`TransitionMethod` that checks the pieces of another one, and passes everything else on."""

    def __init__(self, inner: TransitionMethod, blame: Blame) -> None:
        self._inner, self._blame = inner, blame
        self.name = inner.name

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)

    def lead_in(self, curvature_1pm: float) -> tuple[Piece, ...]:
        return sound(called(self._blame, self._inner.lead_in, curvature_1pm), self._blame)

    def lead_out(self, curvature_1pm: float) -> tuple[Piece, ...]:
        return sound(called(self._blame, self._inner.lead_out, curvature_1pm), self._blame)

    def connect(self, start: PathPose, goal: PathPose) -> tuple[Piece, ...]:
        return leading(called(self._blame, self._inner.connect, start, goal), start, goal, self._blame)

    def between(self, start: CurveEnd, goal: CurveEnd) -> tuple[Piece, ...]:
        return leading(called(self._blame, self._inner.between, start, goal), start.pose, goal.pose, self._blame)

    def standing_transitions(self, start: CurveEnd, goal: CurveEnd, room_m: float = 0.0) -> list[tuple[Piece, ...]]:
        found = called(self._blame, self._inner.standing_transitions, start, goal, room_m)
        if not isinstance(found, Sequence):
            raise self._blame(f"it gave a {type(found).__name__} instead of standing transitions")
        return [leading(pieces, start.pose, goal.pose, self._blame) for pieces in found]


@dataclass(frozen=True)
class _GuardedPricing:
    """`Pricing` that checks the times and pieces of another one."""

    inner: Pricing
    blame: Blame

    @property
    def part(self) -> int:
        return self.inner.part

    @property
    def looks_closer(self) -> bool:
        return self.inner.looks_closer

    def rough_s(self, transitions: TransitionFamily, ends: Sequence[CurveEnd], begins: Sequence[CurveEnd]) -> Floats:
        seconds = np.asarray(called(self.blame, self.inner.rough_s, transitions, ends, begins), dtype=np.float64)
        if seconds.shape != (len(ends), len(begins)) or not np.isfinite(seconds).all():
            raise self.blame(f"it prices {len(ends)} ends and {len(begins)} beginnings with {_shown(seconds)}")
        return seconds

    def timer(self, transitions: TransitionFamily, ends: Sequence[CurveEnd], begins: Sequence[CurveEnd]) -> Timer:
        time = called(self.blame, self.inner.timer, transitions, ends, begins)

        def timed(pairs: Ints, closer: bool) -> Priced:
            priced = called(self.blame, time, pairs, closer)
            pieces, counts = priced.pieces, priced.counts
            whole = len(priced.seconds) == len(pieces) == len(counts) == len(pairs) and pieces.shape[2:] == (5,)
            if not (whole and np.isfinite(priced.seconds).all() and np.isfinite(pieces).all()):
                raise self.blame(f"it prices {len(pairs)} transitions with {_shown(priced.seconds)}")
            if len(counts) and not 0 <= counts.min() <= counts.max() <= pieces.shape[1]:
                raise self.blame(f"it prices transitions of {counts.min()} to {counts.max()} pieces")
            return priced

        return timed


def _shown(seconds: Floats) -> str:
    return f"{seconds.shape} times, {np.count_nonzero(~np.isfinite(seconds))} of them not finite"
