"""Cutting into lines and arcs: within tolerance, without gaps, without slivers, without drift."""

import cmath
import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tests.planner.strategies import floats, forward_pieces, pose_pairs, poses
from touchline.schemas.curves import Curve
from touchline.services.planner.geometry.clothoid import Floats, PathPose, Piece, PiecePath
from touchline.services.planner.segments.fit_arcs import TOLERANCE_M, Cut, biarc, cut
from touchline.services.planner.steering.ccd import ContinuousDubins
from touchline.services.planner.steering.method import CurveEnd, transition

GAP_TOLERANCE = 1e-9
SEGMENT_MIN_M = 1e-3


def check(path: PiecePath, cuts: list[Cut], goal: PathPose) -> None:
    # As the robot reads them: from the message, where only points and sweeps are left.
    curves = [Curve.from_message(piece.curve.to_message()) for piece in cuts]
    ends = [(path.start.x_m, path.start.y_m, path.start.heading_rad), *(curve.end for curve in curves)]
    starts = [*((c.x_m, c.y_m, c.heading_rad) for c in curves), tuple(goal)]
    for (x0, y0, h0), (x1, y1, h1) in zip(ends, starts, strict=True):
        assert math.hypot(x1 - x0, y1 - y0) < GAP_TOLERANCE
        assert abs(cmath.phase(cmath.rect(1.0, h1 - h0))) < GAP_TOLERANCE
    assert cuts[0].ideal_from_m == 0.0
    assert cuts[-1].ideal_to_m == path.length_m
    assert abs(sum(curve.length_m for curve in curves) - path.length_m) < 1e-3 * path.length_m
    for piece in cuts:
        share = np.linspace(0.0, 1.0, 17)
        x, y, _, _ = path.sample(piece.ideal_from_m + share * (piece.ideal_to_m - piece.ideal_from_m))
        assert np.abs(beside(piece.curve, x, y)).max() <= TOLERANCE_M


def beside(curve: Curve, x: Floats, y: Floats) -> Floats:
    """Distance of the points from the circle or line that carries the curve."""
    local = ((x - curve.x_m) + 1j * (y - curve.y_m)) * np.exp(-1j * curve.heading_rad)
    ahead, left = local.real, local.imag
    kappa = curve.curvature_1pm
    off_centre = np.hypot(1.0 - kappa * left, kappa * ahead)
    distance: Floats = (2.0 * left - kappa * (ahead**2 + left**2)) / (1.0 + off_centre)
    return distance


@given(pose_pairs(), floats(0.2, 1.5), floats(0.3, 8.0), floats(-1.0, 1.0), floats(-1.0, 1.0))
def test_transitions_are_cut_within_a_millimetre(
    pair: tuple[PathPose, PathPose], curvature: float, sharpness: float, out_share: float, in_share: float
) -> None:
    start, goal = CurveEnd(pair[0], out_share * curvature), CurveEnd(pair[1], in_share * curvature)
    path = transition(ContinuousDubins(curvature, sharpness), start, goal)
    if path.length_m < 0.01:
        return
    cuts = cut(path, goal.pose)
    check(path, cuts, goal.pose)
    assert min(piece.curve.length_m for piece in cuts) >= SEGMENT_MIN_M


@given(poses, st.lists(forward_pieces(floats(1e-6, 0.02), floats(-1.1, 1.1), st.just(0.0)), min_size=1, max_size=4))
def test_slivers_are_drawn_together_with_their_neighbours(start: PathPose, chain: list[Piece]) -> None:
    path = PiecePath(start, (Piece(0.5), *chain, Piece(0.5, 0.5)))
    cuts = cut(path)
    check(path, cuts, path.end)
    assert min(piece.curve.length_m for piece in cuts) >= SEGMENT_MIN_M


def test_lines_and_arcs_stay_what_they_are() -> None:
    path = PiecePath(PathPose(3.0, -2.0, 0.7), (Piece(2.0), Piece(3.0, 0.4), Piece(1.0)))
    assert [(c.curve.curvature_1pm, c.curve.length_m) for c in cut(path)] == [(0.0, 2.0), (0.4, 3.0), (0.0, 1.0)]


def test_few_segments() -> None:
    """A clothoid to the tightest curvature takes one biarc at a sharpness of 2.4 1/m², two at 1.0."""
    for sharpness, arcs in ((2.4, 2), (1.0, 4)):
        path = PiecePath(PathPose(0.0, 0.0, 0.0), (Piece(1.125 / sharpness, 0.0, sharpness),))
        assert len(cut(path)) == arcs


@given(poses, floats(0.05, 2.0), floats(-1.0, 1.0), floats(-1.0, 1.0))
def test_biarcs_meet_both_poses(start: PathPose, distance: float, bearing: float, turn: float) -> None:
    goal = start.moved(cmath.rect(distance, bearing), turn)
    first, second = biarc(start, goal)
    x, y, heading = second.end
    assert math.hypot(x - goal.x_m, y - goal.y_m) < 1e-10
    assert abs(cmath.phase(cmath.rect(1.0, heading - goal.heading_rad))) < 1e-10
    assert abs(cmath.phase(cmath.rect(1.0, first.end[2] - second.heading_rad))) < 1e-10


def test_a_sliver_bent_the_other_way_is_not_made_up_for_by_a_tighter_arc() -> None:
    """Arcs and straights of a padded Dubins path, with one of 3 mm: blended into the long arc it took 1.28 1/m."""
    sliver = Piece(0.0027565595500644116, -1.125)
    around = (Piece(0.0155980671599, -1.125), Piece(4.943686010869605, 1.125))
    for path in (
        PiecePath(PathPose(0.0, 0.0, 0.0), (Piece(0.1), *around, sliver, Piece(0.5))),
        PiecePath(PathPose(0.0, 0.0, 0.0), (Piece(0.5), sliver, *around[::-1], Piece(0.1))),
        PiecePath(PathPose(0.0, 0.0, 0.0), (Piece(1.0, 1.125), sliver, Piece(1.0, 1.125))),
    ):
        cuts = cut(path, path.end)
        check(path, cuts, path.end)
        assert max(abs(piece.curve.curvature_1pm) for piece in cuts) <= 1.125 * (1 + 1e-9)
        assert min(piece.curve.length_m for piece in cuts) >= SEGMENT_MIN_M


def test_a_sliver_stays_where_what_is_drawn_in_its_place_would_be_too_tight() -> None:
    """An arc of 4.7 mm and the clothoid behind it: as one biarc they took 6.972 1/m of the 6.969 that a robot can."""
    arc, ramp = Piece(0.004707281678, 6.829268292683), Piece(0.011292284019, 6.829268292683, -604.77298)
    most_1pm = 6.969
    path = PiecePath(PathPose(0.0, 0.0, 0.0), (arc, ramp, Piece(2.7)))
    assert max(piece.curve.curvature_1pm for piece in cut(path, path.end)) > most_1pm
    cuts = cut(path, path.end, curvature_max_1pm=most_1pm)
    check(path, cuts, path.end)
    assert max(piece.curve.curvature_1pm for piece in cuts) <= most_1pm
    assert min(piece.curve.length_m for piece in cuts) >= SEGMENT_MIN_M
