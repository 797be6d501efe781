"""Pricing of a method's transitions for ordering: the times of many at once."""

from collections.abc import Sequence

import numpy as np

from touchline.core.angles import wrapped_all
from touchline.services.planner.geometry.clothoid import Floats, Ints
from touchline.services.planner.steering.method import CurveEnd, extension
from touchline.services.planner.steering.plain_words import plain_lengths
from touchline.services.planner.transitions.transitions import Priced, Pricing, Timer, TransitionFamily, Turns

# Number of pairs that are timed one by one within about 50 ms.
ONE_BY_ONE_PART = 50
# Tolerance within which a beginning may lie on the extension of a line or arc (1/m, fraction of the distance and of the
# transition's length); `extension` decides.
NEARLY_ON = 1e-8


class OneByOne:
    """Pricing of any method by constructing each transition: exact and slow."""

    part = ONE_BY_ONE_PART
    looks_closer = False

    def rough_s(self, transitions: TransitionFamily, ends: Sequence[CurveEnd], begins: Sequence[CurveEnd]) -> Floats:
        """Seconds (ends, begins) of plain Dubins paths with the turns on offer."""
        return rough_plain_s(transitions, end_rows(ends), end_rows(begins))

    def timer(self, transitions: TransitionFamily, ends: Sequence[CurveEnd], begins: Sequence[CurveEnd]) -> Timer:
        """Time the quickest of `TransitionFamily.between`."""

        def timed(pairs: Ints, _closer: bool) -> Priced:
            found = [
                min(transitions.between(ends[a], begins[b]), key=lambda each: each.seconds) for a, b in pairs.tolist()
            ]
            counts = np.array([len(transition.path.pieces) for transition in found], dtype=np.int64)
            pieces = np.zeros((len(found), max(counts.tolist(), default=0), 5))
            for row, transition, count in zip(pieces, found, counts.tolist(), strict=True):
                row[:count] = np.reshape(transition.path.pieces, (count, 5))
            return Priced(np.array([transition.seconds for transition in found]), pieces, counts)

        return timed


def pricing_of(transitions: TransitionFamily) -> Pricing:
    """Pricing of transitions: the method's own, else one by one."""
    return transitions.pricing or OneByOne()


def end_rows(ends: Sequence[CurveEnd]) -> Floats:
    """Rows (n, 5) of x (m), y (m), heading (rad), curvature (1/m) and maximum speed (m/s)."""
    return np.array([(*end.pose, end.curvature_1pm, end.speed_mps) for end in ends])


def rough_plain_s(transitions: TransitionFamily, starts: Floats, goals: Floats) -> Floats:
    """Seconds (n, m) of plain Dubins paths between rows of x (m), y (m), heading (rad), at steady speeds.

    Args:
        transitions: Transitions of the method in use.
        starts: (n, 3 or more) x (m), y (m), heading (rad).
        goals: (m, 3 or more) the same.
    """
    tables = [
        plain_lengths(starts, goals, turns.curvature_1pm, turn_weight=turn_weight(transitions, turns))
        for turns in transitions.turns
    ]
    return np.asarray(np.minimum.reduce(tables) / transitions.limits.transit_speed_mps)


def turn_weight(transitions: TransitionFamily, turns: Turns) -> float:
    """Ratio of the times for a metre in a turn and on a straight."""
    bend = np.array([turns.curvature_1pm])
    steady = float(np.sqrt(transitions.limits.square_cap(bend, np.zeros(1))[0]))
    return max(transitions.limits.transit_speed_mps / min(turns.speed_mps, steady), 1.0)


def extend(
    transitions: TransitionFamily, ends: Sequence[CurveEnd], begins: Sequence[CurveEnd], pairs: Ints, priced: Priced
) -> None:
    """Replace transitions by the extension of a line or arc, where that joins a pair and is quicker.

    Args:
        transitions: Transitions of the method in use.
        ends: Ends of painted segments.
        begins: Beginnings of painted segments.
        pairs: (n, 2) numbers of an end and a beginning.
        priced: Transitions (n) found so far, changed in place.
    """
    starts, goals = end_rows(ends)[pairs[:, 0]], end_rows(begins)[pairs[:, 1]]
    apart = (goals[:, 0] - starts[:, 0] + 1j * (goals[:, 1] - starts[:, 1])) * np.exp(-1j * starts[:, 2])
    turn = wrapped_all(goals[:, 2] - starts[:, 2])
    aside = np.abs((apart * np.exp(-0.5j * turn)).imag)
    nearly = (np.abs(goals[:, 3] - starts[:, 3]) <= NEARLY_ON) & (aside <= NEARLY_ON * (1.0 + np.abs(apart)))
    for i in np.flatnonzero(nearly).tolist():
        start, goal = ends[pairs[i, 0]], begins[pairs[i, 1]]
        length = float(priced.pieces[i, : priced.counts[i], 0].sum())
        path = extension(start, goal, length * (1.0 + NEARLY_ON))
        if path is None:
            continue
        seconds = transitions.seconds(path.pieces, transitions.speed_mps(start), transitions.speed_mps(goal))
        if seconds < priced.seconds[i]:
            priced.seconds[i], priced.counts[i] = seconds, len(path.pieces)
            priced.pieces[i, : len(path.pieces)] = np.reshape(path.pieces, (-1, 5))
