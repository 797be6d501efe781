"""The study's planners as re-implemented: its figures are reproduced, its failures are there, and ours has none."""

import math

import pytest
from hypothesis import given

from tests.planner.strategies import pose_pairs
from touchline.core.angles import TAU
from touchline.schemas.catalogue import load_template
from touchline.schemas.errors import PlanningError
from touchline.services.planner.geometry.clothoid import PathPose, PiecePath
from touchline.services.planner.steering.method import CurveEnd
from touchline.services.planner.steering.turns import ContinuousTurn
from touchline_research.driven_template import DPP, OURS, STUDY_CCD, STUDY_KAPPA_1PM, UNPADDED
from touchline_research.pairs import close_pairs, random_pairs, tally
from touchline_research.pitch import Pitch
from touchline_research.sent import CHORD_M, as_biarcs, as_chords
from touchline_research.sent import joints as joints_of
from touchline_research.study_ccd import CLOSEST_M

ORIGIN = PathPose(0.0, 0.0, 0.0)
KAPPA, SIGMA = STUDY_KAPPA_1PM, 1.0


@pytest.fixture(scope="module")
def pitch() -> Pitch:
    return Pitch(load_template("soccer-11"))


def turned(path: PiecePath) -> float:
    return sum(abs(piece.turn_at(piece.length_m)) for piece in path.pieces)


@pytest.mark.parametrize(("sigma", "reported"), [(1.0, 0.14), (2.1, 0.08)])
def test_its_ccd_is_as_much_longer_as_the_study_reports(pitch: Pitch, sigma: float, reported: float) -> None:
    """On another pitch in another order: within 3 points of a hundred."""
    assert pitch.longer(STUDY_CCD, sigma) == pytest.approx(reported, abs=0.03)


def test_its_dpp_is_padded_by_0_6_m_a_line_at_most(pitch: Pitch) -> None:
    padding = pitch.drive(DPP).length_m - pitch.drive(UNPADDED).length_m
    assert 0.0 < padding <= 0.6 * len(pitch.strokes) + 1e-9
    assert pitch.drive(DPP).seconds(1.5) > pitch.drive(UNPADDED).length_m / 1.5


def test_a_small_turn_winds_a_full_circle_where_ours_does_not() -> None:
    """10 m on, 1 m to the side: two turns of a few degrees, and each winds once round in the study's planner."""
    start, goal = CurveEnd(ORIGIN, 0.0), CurveEnd(PathPose(10.0, 1.0, 0.2), 0.0)
    theirs = PiecePath(ORIGIN, STUDY_CCD.method(KAPPA, SIGMA).between(start, goal))
    ours = PiecePath(ORIGIN, OURS.method(KAPPA, SIGMA).between(start, goal))
    assert turned(theirs) > 2 * TAU
    assert turned(ours) < 1.0
    assert abs(theirs.end.point - goal.pose.point) < 1e-9


def test_lsr_and_rsl_are_missing() -> None:
    """A change of lane, which plain Dubins drives as LSR, takes turns of one hand."""
    path = PiecePath(ORIGIN, STUDY_CCD.method(KAPPA, 7.0).connect(ORIGIN, PathPose(12.0, 6.0, 0.0)))
    hands = {math.copysign(1.0, p.turn_at(p.length_m)) for p in path.pieces if p.turn_at(p.length_m)}
    assert len(hands) == 1


def test_close_poses_fail_and_ours_do_not() -> None:
    theirs, ours = (tally(c.method(KAPPA, SIGMA), close_pairs(60), 60, KAPPA, SIGMA) for c in (STUDY_CCD, OURS))
    assert theirs.complete == 0
    assert ours.feasible == ours.continuous == ours.tried == 60
    with pytest.raises(PlanningError, match=r"closer than 0\.1 m"):
        STUDY_CCD.method(KAPPA, SIGMA).connect(ORIGIN, PathPose(0.99 * CLOSEST_M, 0.0, 0.0))


def test_a_failed_or_wrong_transition_is_counted() -> None:
    """The tally sees a transition that misses its goal and one that is too tight."""
    pairs = list(random_pairs(20))
    method = OURS.method(KAPPA, SIGMA)
    swapped = [pair._replace(goal=other.goal) for pair, other in zip(pairs, pairs[1:] + pairs[:1], strict=True)]

    class Wrong:
        name, lead_in, lead_out, connect = method.name, method.lead_in, method.lead_out, method.connect

        def between(self, start: CurveEnd, goal: CurveEnd) -> object:
            return method.between(start, next(b.goal for a, b in zip(pairs, swapped, strict=True) if a.goal == goal))

    assert tally(Wrong(), iter(pairs), 20, KAPPA, SIGMA).feasible == 0  # type: ignore[arg-type]
    assert tally(OURS.method(2.0, 4.0), random_pairs(20), 20, KAPPA, SIGMA).feasible < 20


def test_its_chords_turn_at_every_joint_and_our_arcs_do_not(pitch: Pitch) -> None:
    transition = PiecePath(ORIGIN, ContinuousTurn(KAPPA, SIGMA).pieces(2.0))
    gap, kink, _ = joints_of(as_chords(transition))
    assert gap.max() < 1e-12
    assert kink.max() == pytest.approx(KAPPA * CHORD_M, rel=0.01)
    gap, kink, _ = joints_of(as_biarcs(transition))
    assert max(gap.max(), kink.max()) < 1e-9
    ideal = as_chords(transition)[:, 4].sum()
    assert ideal == pytest.approx(transition.length_m, abs=1e-5)


@given(pose_pairs())
def test_its_paths_lead_to_the_goal_and_are_never_shorter_than_ours(pair: tuple[PathPose, PathPose]) -> None:
    start, goal = pair
    if abs(goal.point - start.point) < CLOSEST_M:
        return
    theirs = PiecePath(start, STUDY_CCD.method(KAPPA, SIGMA).connect(start, goal))
    assert abs(theirs.end.point - goal.point) < 1e-9
    ours = PiecePath(start, OURS.method(KAPPA, SIGMA).connect(start, goal))
    assert ours.length_m <= theirs.length_m * (1 + 1e-9)
