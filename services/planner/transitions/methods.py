"""Shipped transition methods, each with its compiled pricing of thousands of pairs at once."""

from collections.abc import Sequence

import numpy as np

from touchline.services.planner.geometry.clothoid import Floats, Ints
from touchline.services.planner.limits import Limits
from touchline.services.planner.steering.ccd import ContinuousDubins
from touchline.services.planner.steering.dubins_padded import PADDING_AFTER_M, PADDING_BEFORE_M, PaddedDubins
from touchline.services.planner.steering.g2 import Steering
from touchline.services.planner.steering.method import CurveEnd
from touchline.services.planner.steering.word_lengths import word_lengths
from touchline.services.planner.transitions.method_choice import Method
from touchline.services.planner.transitions.piece_table import PieceTable
from touchline.services.planner.transitions.plain_times import PLAIN_PIECES, plain_times
from touchline.services.planner.transitions.pricing import (
    end_rows,
    extend,
    rough_plain_s,
    turn_weight,
)
from touchline.services.planner.transitions.transition_rows import transition_rows
from touchline.services.planner.transitions.transition_times import TRACK_PIECES, TurnRows, transition_times
from touchline.services.planner.transitions.transitions import Priced, Timer, TransitionFamily

# Number of pairs that are timed within about 50 ms.
PART = 3000


class SteeredPricing:
    """Pricing of `g2`: the quickest words of all turns; in the closer pass also short hops and standstills."""

    part = PART
    looks_closer = True

    def rough_s(self, transitions: TransitionFamily, ends: Sequence[CurveEnd], begins: Sequence[CurveEnd]) -> Floats:
        """Seconds (ends, begins) of words, with the turns driven at the speed that they are made for."""
        starts, goals = end_rows(ends), end_rows(begins)
        fast = transitions.limits.transit_speed_mps
        tables = [
            word_lengths(
                starts, goals, turns.curvature_1pm, turns.sharpness_1pm2, turn_weight=max(fast / turns.speed_mps, 1.0)
            )
            for turns in transitions.turns[1::2] or transitions.turns
        ]
        return np.asarray(np.minimum.reduce(tables) / fast)

    def timer(self, transitions: TransitionFamily, ends: Sequence[CurveEnd], begins: Sequence[CurveEnd]) -> Timer:
        """Time words; in the closer pass also short hops, cusps and turns on the spot."""
        rows = transition_rows(ends, begins, transitions)

        def timed(pairs: Ints, closer: bool) -> Priced:
            priced = words_or_hops(rows, transitions.limits, pairs, hops=closer)
            if not (closer and transitions.standing):
                return priced
            for i, (a, b) in enumerate(pairs.tolist()):
                transition = transitions.quickest_standing(ends[a], begins[b], float(priced.seconds[i]))
                if transition:
                    priced.seconds[i], priced.counts[i] = transition.seconds, len(transition.path.pieces)
                    priced.pieces[i, : priced.counts[i]] = transition.path.pieces
            return priced

        return timed


class WordPricing:
    """Pricing of `ccd`: CC words, or the extension of a line or arc."""

    part = PART
    looks_closer = False

    def rough_s(self, transitions: TransitionFamily, ends: Sequence[CurveEnd], begins: Sequence[CurveEnd]) -> Floats:
        """Seconds (ends, begins) of words, with the turns driven at their steady speed."""
        (turns,) = transitions.turns
        weight = turn_weight(transitions, turns)
        limits = turns.curvature_1pm, turns.sharpness_1pm2
        lengths = word_lengths(end_rows(ends), end_rows(begins), *limits, turn_weight=weight)
        return np.asarray(lengths / transitions.limits.transit_speed_mps)

    def timer(self, transitions: TransitionFamily, ends: Sequence[CurveEnd], begins: Sequence[CurveEnd]) -> Timer:
        """Time the words, with a clothoid out of and into painted arcs."""
        rows = transition_rows(ends, begins, transitions)

        def timed(pairs: Ints, _closer: bool) -> Priced:
            priced = words_or_hops(rows, transitions.limits, pairs, hops=False)
            extend(transitions, ends, begins, pairs, priced)
            return priced

        return timed


class PaddedPricing:
    """Pricing of `dubins-padded`: plain Dubins paths between paddings, or the extension of a line or arc."""

    part = PART
    looks_closer = False

    def rough_s(self, transitions: TransitionFamily, ends: Sequence[CurveEnd], begins: Sequence[CurveEnd]) -> Floats:
        """Seconds (ends, begins) of paddings and Dubins path, with the turns driven at their steady speed."""
        starts, goals = (
            padded_rows(transitions, ends, PADDING_AFTER_M),
            padded_rows(transitions, begins, -PADDING_BEFORE_M),
        )
        paddings = (PADDING_AFTER_M + PADDING_BEFORE_M) / transitions.limits.transit_speed_mps
        return rough_plain_s(transitions, starts, goals) + paddings

    def timer(self, transitions: TransitionFamily, ends: Sequence[CurveEnd], begins: Sequence[CurveEnd]) -> Timer:
        """Time the paths with their paddings."""
        (turns,) = transitions.turns
        rows = padded_rows(transitions, ends, PADDING_AFTER_M), padded_rows(transitions, begins, -PADDING_BEFORE_M)
        paddings = PADDING_AFTER_M, PADDING_BEFORE_M

        def timed(pairs: Ints, _closer: bool) -> Priced:
            found = PieceTable(np.zeros((len(pairs), PLAIN_PIECES, 5)), np.zeros(len(pairs), dtype=np.int64))
            seconds = plain_times(rows, turns.curvature_1pm, paddings, transitions.limits.caps, pairs, found)
            priced = Priced(seconds, *found)
            extend(transitions, ends, begins, pairs, priced)
            return priced

        return timed


def words_or_hops(rows: TurnRows, limits: Limits, pairs: Ints, *, hops: bool) -> Priced:
    """Find the quickest words, or also short hops, for pairs (n, 2) of ends and beginnings of `transition_rows`.

    Args:
        rows: Rows by `transition_rows`.
        limits: Limits of the plan.
        pairs: (n, 2) numbers of an end and a beginning.
        hops: Whether short hops are included.
    """
    found = PieceTable(np.zeros((len(pairs), TRACK_PIECES, 5)), np.zeros(len(pairs), dtype=np.int64))
    return Priced(transition_times(rows, limits.caps, pairs, hops, found), *found)


def padded_rows(transitions: TransitionFamily, ends: Sequence[CurveEnd], padding_m: float) -> Floats:
    """Rows (n, 4) of the pose (m, m, rad) `padding_m` straight on from each end, and the speed (m/s) there."""
    moved = (end.pose.moved(complex(padding_m, 0.0), 0.0) for end in ends)
    return np.array([(*pose, transitions.speed_mps(end)) for pose, end in zip(moved, ends, strict=True)])


G2 = Method(lambda limits: TransitionFamily.by_time(Steering, limits, SteeredPricing()), by_dynamics=True)
CCD = Method(lambda limits: TransitionFamily.of_one(ContinuousDubins, limits, WordPricing()))
DUBINS_PADDED = Method(
    lambda limits: TransitionFamily.of_one(
        lambda curvature, _sharpness: PaddedDubins(curvature), limits, PaddedPricing()
    ),
    joins=False,
)
