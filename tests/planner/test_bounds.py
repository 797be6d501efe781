"""Shortcuts in finding short hops change no result: bounds are bounds, and the quick solver finds the same."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.planner.strategies import floats, pose_pairs
from touchline.schemas.messages import PlanOptions
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath
from touchline.services.planner.limits import Limits
from touchline.services.planner.marking import transitions_of
from touchline.services.planner.steering.dubins import dubins_pieces
from touchline.services.planner.steering.dubins_bound import least_plain
from touchline.services.planner.steering.forward import (
    least_length,
)
from touchline.services.planner.steering.method import CurveEnd
from touchline.services.planner.transitions.piece_table import PieceTable
from touchline.services.planner.transitions.transition_rows import transition_rows
from touchline.services.planner.transitions.transition_times import (
    TRACK_PIECES,
    TurnRows,
    least_time,
    transition_times,
)
from touchline.services.planner.transitions.transitions import Transition

ORIGIN = PathPose(0.0, 0.0, 0.0)


@given(pose_pairs())
def test_no_plain_dubins_path_is_shorter_than_its_bound(pair: tuple[PathPose, PathPose]) -> None:
    z, turn = pair[1].seen_from(pair[0])
    length = sum(piece.length_m for piece in dubins_pieces(*pair, 1.0))
    bound = least_plain(z.real, z.imag, turn)
    assert length - 1e-5 <= bound <= length + 1e-9 or bound < length - 6.0


@given(st.lists(floats(-0.8, 0.8), max_size=4), floats(-0.8, 0.8), floats(-0.8, 0.8), st.lists(floats(0.0, 3.0)))
def test_no_transition_that_turns_so_much_is_shorter_than_its_bound(
    inner: list[float], first: float, last: float, holds: list[float]
) -> None:
    limit, extremes = 0.8, [first, *inner, last]
    pieces: list[Piece] = []
    for i, (a, b) in enumerate(pairwise(extremes)):
        pieces += [Piece(abs(b - a), a, math.copysign(1.0, b - a)), Piece(holds[i] if i < len(holds) else 0.0, b)]
    path = PiecePath(ORIGIN, tuple(pieces))
    end = path.end
    assert least_length(np.array([first, last]), end.point, end.heading_rad, limit) <= path.length_m + 1e-12


@pytest.mark.parametrize("curvature", [0.0, 0.4])
def test_of_all_turns_the_quickest_is_found_without_trying_all(curvature: float) -> None:
    limits = Limits.of(Vehicle(), PlanOptions())
    transitions = transitions_of(Vehicle(), PlanOptions(), limits)
    rng = np.random.default_rng(3)
    poses = [PathPose(x, y, h) for x, y, h in rng.uniform((0, 0, -4), (5, 5, 4), (12, 3)).tolist()]
    ends = [CurveEnd(pose, curvature * (i % 2)) for i, pose in enumerate(poses)]
    rows = transition_rows(ends, ends, transitions)
    pairs = np.array([(a, b) for a in range(12) for b in range(12) if a != b])
    found = PieceTable(np.zeros((len(pairs), TRACK_PIECES, 5)), np.zeros(len(pairs), dtype=np.int64))
    seconds = transition_times(rows, limits.caps, pairs, True, found)
    others = PieceTable(np.zeros_like(found.pieces), np.zeros_like(found.counts))
    alone = [TurnRows(*(each[k : k + 1] for each in rows)) for k in range(len(transitions.turns))]
    by_turns = [transition_times(each, limits.caps, pairs, True, others) for each in alone]
    assert seconds.tolist() == np.min(by_turns, axis=0).tolist()
    for p, (a, b) in enumerate(pairs.tolist()):
        for k, turns in enumerate(transitions.turns):
            start, goal = rows.starts[k, a], rows.goals[k, b]
            assert least_time(start, goal, turns.curvature_1pm, limits.caps) <= by_turns[k][p] + 1e-9
        transition = PiecePath(ends[a].pose, tuple(Piece(*row) for row in found.pieces[p, : found.counts[p]].tolist()))
        assert abs(transition.end.point - ends[b].pose.point) < 1e-9


@given(pose_pairs(), floats(-0.5, 0.5), st.sampled_from([0.0, 0.2]))
def test_no_transition_with_a_standstill_is_quicker_than_its_bound(
    pair: tuple[PathPose, PathPose], first: float, last: float
) -> None:
    transitions = transitions_of(Vehicle(), PlanOptions(), Limits.of(Vehicle(), PlanOptions()))
    start, goal = CurveEnd(pair[0], first), CurveEnd(pair[1], last)
    speeds = transitions.speed_mps(start), transitions.speed_mps(goal)
    bound = transitions.standing_bound_s(start, goal, speeds)

    def stands(transition: Transition) -> bool:
        return any(p.spin_rad or p.direction < 0 for p in transition.path.pieces)

    for transition in filter(stands, transitions.between(start, goal)):
        assert transition.seconds >= bound - 1e-9
    quickest = transitions.quickest_standing(start, goal, math.inf)
    # Straight on is one of them too, if the goal lies there: that the bound rules it out costs nothing.
    if quickest and stands(quickest):
        # One that just has to be quicker than something slower is found all the same.
        again = transitions.quickest_standing(start, goal, quickest.seconds + 1e-6)
        assert again is not None
        assert again.seconds == quickest.seconds
