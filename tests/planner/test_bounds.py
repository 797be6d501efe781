"""What spares work in finding short hops changes nothing: bounds are bounds, and the quick solver finds the same."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.planner.strategies import floats, headings, pose_pairs
from touchline.schemas.messages import PlanOptions
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath
from touchline.services.planner.limits import Limits
from touchline.services.planner.marking import transitions_of
from touchline.services.planner.steering.circles import circle
from touchline.services.planner.steering.dubins import dubins_pieces
from touchline.services.planner.steering.dubins_bound import least_plain
from touchline.services.planner.steering.forward import (
    STARTS,
    WITH_STRAIGHT,
    attempt,
    least_length,
    three_elements,
    turn_of,
)
from touchline.services.planner.steering.method import CurveEnd
from touchline.services.planner.steering.newton3 import solve_three
from touchline.services.planner.steering.profile import amount_of, solve
from touchline.services.planner.steering.query import Query
from touchline.services.planner.transitions.piece_table import PieceTable
from touchline.services.planner.transitions.transition_rows import transition_rows
from touchline.services.planner.transitions.transition_times import (
    TRACK_PIECES,
    TurnRows,
    least_time,
    transition_times,
)
from touchline.services.planner.transitions.transitions import BRAKING_SHARE, Transition

ORIGIN = PathPose(0.0, 0.0, 0.0)


@given(pose_pairs())
@settings(max_examples=60)
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


@pytest.mark.parametrize(
    ("pieces", "length"),
    [
        pytest.param((Piece(0.8, 0.0, -1.0), Piece(7.0, -0.8), Piece(0.8, -0.8, 1.0)), 8.6, id="more than a full turn"),
        pytest.param((Piece(3.0),), 3.0, id="straight"),
        pytest.param((Piece(5.0, 0.8), Piece(2.0)), 7.0, id="arc and straight"),
    ],
)
def test_the_bound_on_transitions_that_turn_so_much_is_met(pieces: tuple[Piece, ...], length: float) -> None:
    end = PiecePath(ORIGIN, pieces).end
    ends = np.array([pieces[0].curvature_1pm, pieces[-1].curvature_end_1pm])
    assert least_length(ends, end.point, end.heading_rad, 0.8) == pytest.approx(length)


@pytest.mark.full  # nothing else has the general one compiled
@given(floats(-5, 5), floats(-5, 5), headings, floats(-0.8, 0.8), floats(-0.8, 0.8))
@settings(max_examples=60)
def test_the_quick_solver_finds_what_the_general_one_finds(x: float, y: float, h: float, a: float, b: float) -> None:
    limit, ends, goal = 0.8, np.array([a, b]), complex(x, y)
    for straight, start in zip(WITH_STRAIGHT, STARTS, strict=True):
        u = np.array([u if straight and i == 1 else amount_of(u, limit) for i, u in enumerate(start)])
        turn = h + math.tau * round((turn_of(u, straight, ends, limit) - h) / math.tau)
        general, quick = u.copy(), u.copy()
        length = solve(three_elements(straight), general, ends, limit, goal, turn)
        assert solve_three(quick, straight, ends, limit, goal, turn) == length
        if length < math.inf:
            assert quick.tolist() == general.tolist()
            # With what is just long enough it is found all the same.
            query = Query(ends, goal, h, circle(limit))
            assert attempt(u.copy(), straight, query, length + 1e-9) == length


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
@settings(max_examples=50)
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


def test_the_bound_of_transitions_with_a_standstill_is_what_braking_and_gathering_speed_take() -> None:
    """At 1 m/s² two seconds, if what lies between the places where the robot may stand is nothing, and more beyond."""
    transitions = transitions_of(Vehicle(), PlanOptions(), Limits.of(Vehicle(), PlanOptions()))
    room = transitions.limits.stopping_distance_m(1.0) / BRAKING_SHARE
    start = CurveEnd(ORIGIN, 0.0)
    near, far = (CurveEnd(PathPose(2.0 * room + gap, 0.0, 0.0), 0.0) for gap in (0.0, 14.0))
    assert transitions.standing_bound_s(start, near, (1.0, 1.0)) == pytest.approx(2.0, abs=0.05)
    assert transitions.standing_bound_s(start, far, (1.0, 1.0)) >= 2.0 + 14.0 / transitions.limits.transit_speed_mps
