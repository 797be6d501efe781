"""Cubic curves between poses: what they are, what the study printed instead, and those that are chosen."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given

from tests.planner.strategies import floats, headings, poses
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.vehicles.shipped import SHIPPED
from touchline.services.planner.geometry.clothoid import PathPose
from touchline.services.planner.poses.cubic_path import CubicPath, chosen_lengths, curve_of
from touchline.services.planner.poses.kernels import cubic_curve as kernels
from touchline.services.planner.poses.kernels.cubic_curve import (
    FINE,
    Terms,
    price,
)
from touchline.services.planner.poses.kernels.turned_line import turned_line_s
from touchline.services.planner.poses.rest_to_rest import rest_to_rest_s
from touchline.services.planner.poses.shipped_methods import TURN_LINE_TURN
from touchline.services.planner.poses.speed_laws import CUBIC, UNIFORM, rates_over
from touchline.services.planner.poses.traveller import Traveller
from touchline.services.planner.segments.fit_arcs import cut
from touchline.services.planner.segments.sections import runs
from touchline_research.tracking.studied_robot import SPEED_MPS, STUDY_CAPS, YAW_RADPS

pytestmark = pytest.mark.xdist_group("poses")  # its kernels are compiled in one worker

ORIGIN = PathPose(0.0, 0.0, 0.0)
# As Python: for arrays, and for calls one by one, each would be compiled anew.
cubic_curve, point, tangent = kernels.cubic_curve.py_func, kernels.point.py_func, kernels.tangent.py_func
bend, tangent_change = kernels.bend.py_func, kernels.tangent_change.py_func
WAFFLE = Traveller.of(SHIPPED["turtlebot3-waffle-pi"].vehicle, PlanOptions())
AUTO = CubicPath()
CUBIC_RATES = rates_over(CUBIC, np.linspace(0.0, 1.0, FINE + 1))


def random_pairs(count, seed=1):
    rng = np.random.default_rng(seed)
    place = rng.uniform(-10.0, 10.0, (4, count))
    heading, length = rng.uniform(-math.pi, math.pi, (2, count)), rng.uniform(0.1, 10.0, (2, count))
    return place[0] + 1j * place[1], place[2] + 1j * place[3], heading, length * rng.choice([-1.0, 1.0], count)


def test_a_curve_has_its_ends_headings_and_tangents():
    start, goal, heading, length = random_pairs(100_000)
    leaving, arriving = length * np.exp(1j * heading)
    curve = cubic_curve(start, goal, leaving, arriving)
    assert np.abs(point(curve, 0.0) - start).max() < 1e-12
    assert np.abs(point(curve, 1.0) - goal).max() < 1e-12
    for s, end, way, wanted in ((0.0, leaving, heading[0], length[0]), (1.0, arriving, heading[1], length[1])):
        found = tangent(curve, s)
        assert np.abs(found - end).max() < 1e-12
        assert np.abs(np.abs(found) - np.abs(wanted)).max() < 1e-12
        travelled = way + np.where(wanted > 0.0, 0.0, math.pi)
        assert np.abs(np.angle(found * np.exp(-1j * travelled))).max() < 1e-12


@given(poses, poses, floats(0.5, 10.0), floats(0.5, 10.0), floats(0.05, 0.95))
def test_bend_is_what_differences_find(start, goal, leaving, arriving, s):
    curve, h = curve_of(start, goal, (leaving, arriving)), 1e-5
    stretch, curvature, sharpness = bend(curve, s)
    if stretch < 0.2:
        return
    assert tangent(curve, s) == pytest.approx((point(curve, s + h) - point(curve, s - h)) / (2.0 * h), abs=1e-6)
    change = (tangent(curve, s + h) - tangent(curve, s - h)) / (2.0 * h)
    assert tangent_change(curve, s) == pytest.approx(change, abs=1e-5)
    turned = np.angle(tangent(curve, s + h) / tangent(curve, s - h))
    assert curvature == pytest.approx(turned / (2.0 * h * stretch), rel=1e-3, abs=1e-4)
    twist = (bend(curve, s + h)[1] - bend(curve, s - h)[1]) / (2.0 * h * stretch)
    assert sharpness == pytest.approx(twist, rel=1e-2, abs=1e-2)


@pytest.mark.parametrize("distance_m", [0.05, 1.0, 20.0])
def test_straight_ahead_the_chosen_curve_is_a_line_that_goes_on_forward(distance_m):
    found = AUTO.between(ORIGIN, PathPose(distance_m, 0.0, 0.0), WAFFLE)
    (piece,) = found.path.pieces
    assert (piece.curvature_1pm, piece.sharpness_1pm2, piece.direction) == (0.0, 0.0, 1)
    assert piece.length_m == pytest.approx(distance_m, rel=1e-12)
    assert found.progress is not None
    assert found.progress.rate_m.min() >= 0.05 * distance_m


def turning_rad(curve):
    ways = tangent(curve, np.linspace(0.0, 1.0, 4001))
    return np.abs(np.angle(ways[1:] / ways[:-1])).sum()


def goals_ahead(count, seed=5):
    """0.3 to 8 m off, within 60° of straight ahead, and to be looked at within 60° of how they lie."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        bearing = rng.uniform(-1.0, 1.0) * math.pi / 3.0
        heading = bearing + rng.uniform(-1.0, 1.0) * math.pi / 3.0
        distance = rng.uniform(0.3, 8.0)
        yield PathPose(distance * math.cos(bearing), distance * math.sin(bearing), heading)


def test_goals_ahead_are_reached_without_winding():
    wound = 0
    for goal in goals_ahead(60):
        found = AUTO.between(ORIGIN, goal, WAFFLE)
        turned = sum(abs(piece.turn_at(piece.length_m)) for piece in found.path.pieces)
        assert math.degrees(turned) < 150.0
        wound += math.degrees(turning_rad(curve_of(ORIGIN, goal, (10.0, 10.0)))) > 200.0
    assert wound > 10


@given(poses, poses)
def test_a_chosen_curve_ends_at_the_goal_within_the_limits(start, goal):
    found = AUTO.between(start, goal, WAFFLE)
    end, pieces = found.path.end, found.path.pieces
    assert abs(end.point - goal.point) < 1e-9
    assert abs(math.remainder(end.heading_rad - goal.heading_rad, math.tau)) < 1e-9
    tightest = WAFFLE.limits.curvature_max_1pm
    bends = [abs(k) for p in pieces for k in (p.curvature_1pm, p.curvature_end_1pm)]
    assert max(bends, default=0.0) <= tightest * (1.0 + 1e-9)
    assert bool(found.progress) != ("by g2" in found.note)
    if found.progress:
        assert len({piece.direction for piece in pieces}) == 1
        steps = [b.curvature_1pm - a.curvature_end_1pm for a, b in pairwise(pieces)]
        assert np.abs(steps).max(initial=0.0) < 1e-9


def test_lines_and_arcs_are_within_a_millimetre_of_the_curve():
    for goal in goals_ahead(5, seed=6):
        for sense in (1.0, -1.0):
            curve = curve_of(ORIGIN, goal, (sense * 2.0, sense * 2.0))
            try:
                found = CubicPath((sense * 2.0,)).between(ORIGIN, goal, WAFFLE)
            except PlanningError:
                continue
            dense = point(curve, np.linspace(0.0, 1.0, 5_001))
            (run,) = runs(found.path, goal)
            for each in cut(run.path, run.goal):
                x, y, _, _ = each.curve.at(np.linspace(0.0, each.curve.length_m, 5))
                assert np.abs((x + 1j * y)[:, None] - dense).min(axis=1).max() < 1e-3


def test_without_a_drivable_curve_there_is_g2_and_it_is_said():
    roller = Traveller.of(SHIPPED["clay-roller"].vehicle, PlanOptions())
    found = AUTO.between(ORIGIN, PathPose(0.0, 2.0, 0.0), roller)
    assert "no cubic curve within 0.273 1/m found, so by g2" in found.note
    assert abs(found.path.end.point - 2j) < 1e-9


STUDY_TERMS = Terms(math.inf, 0.0, np.zeros(0), STUDY_CAPS)


def turns_rad(first, last):
    return sum(abs(math.remainder(angle, math.tau)) for angle in (first, last))


@given(headings, headings, floats(0.1, 8.0))
def test_turn_line_turn_takes_as_long_as_its_parts(bearing, heading, distance_m):
    goal = distance_m * complex(math.cos(bearing), math.sin(bearing))
    forward = turns_rad(bearing, heading - bearing)
    backward = turns_rad(bearing + math.pi, heading - bearing - math.pi)
    for may, turned in ((False, forward), (True, min(forward, backward))):
        for terms, peak in ((STUDY_TERMS, 1.0), (STUDY_TERMS._replace(rates=CUBIC_RATES), 1.5)):
            wanted = peak * distance_m / SPEED_MPS + turned / YAW_RADPS
            assert turned_line_s(goal, heading, may, terms) == pytest.approx(wanted, rel=1e-9)


def test_turns_on_the_spot_are_priced_as_they_are_planned():
    """Along the way both gather speed alike, which the price leaves out."""
    goal = PathPose(2.0, 1.0, 2.0)
    terms = Terms(math.inf, 0.0, np.zeros(0), WAFFLE.limits.caps)
    path = TURN_LINE_TURN.between(ORIGIN, goal, WAFFLE).path
    caps = WAFFLE.limits.caps
    gathering_s = caps.transit_mps / caps.acceleration_mps2
    priced = turned_line_s(goal.point, goal.heading_rad, True, terms)
    assert rest_to_rest_s(path.pieces, WAFFLE) == pytest.approx(priced + gathering_s, rel=1e-3)


@given(headings, headings, floats(0.1, 8.0))
def test_a_curve_is_chosen_only_if_it_is_as_quick_as_turning(bearing, heading, distance_m):
    goal = PathPose(distance_m * math.cos(bearing), distance_m * math.sin(bearing), heading)
    terms = STUDY_TERMS._replace(tightest=6.0, slowest=0.05 * distance_m)
    lengths = chosen_lengths(goal.point, heading, WAFFLE, terms)
    fixed = chosen_lengths(goal.point, heading, replace(WAFFLE, can_spin=False), terms)
    turned_s = turned_line_s(goal.point, heading, True, terms)
    if math.isfinite(lengths[0]):
        assert lengths == fixed
        assert price(curve_of(ORIGIN, goal, lengths), terms, FINE) <= turned_s * (1.0 + 1e-8)
    elif math.isfinite(fixed[0]):
        assert price(curve_of(ORIGIN, goal, fixed), terms, FINE) > turned_s


def test_one_that_can_turn_on_the_spot_does_so_where_that_is_quicker_and_says_so():
    around = PathPose(2.0, 0.0, 0.5 * math.pi)
    turned = AUTO.between(ORIGIN, around, WAFFLE)
    assert "found that is as quick as turn, line, turn, so by g2" in turned.note
    assert AUTO.between(ORIGIN, around, replace(WAFFLE, can_spin=False)).progress
    assert CubicPath(law=UNIFORM).between(ORIGIN, around, WAFFLE).progress  # a law that cannot stand
    assert CubicPath((2.0,)).between(ORIGIN, around, WAFFLE).progress  # lengths that are asked for are kept to


def test_one_that_may_not_reverse_is_not_sent_backward():
    forward = Traveller.of(SHIPPED["turtlebot3-waffle-pi"].vehicle, PlanOptions(forward_only=True))
    behind = PathPose(-2.0, 0.1, 0.0)
    assert {piece.direction for piece in AUTO.between(ORIGIN, behind, WAFFLE).path.pieces} == {-1}
    assert {piece.direction for piece in AUTO.between(ORIGIN, behind, forward).path.pieces} == {1}


@pytest.mark.parametrize(
    ("tangents_m", "goal", "says"),
    [
        ((10.0,), PathPose(2.0, 0.05, 0.0), "k is chosen|leave k out"),
        ((1.0, -1.0), PathPose(2.0, 0.0, 0.0), "of one sign"),
        ((0.0,), PathPose(2.0, 0.0, 0.0), "of one sign"),
        ((math.nan,), PathPose(2.0, 0.0, 0.0), "of one sign"),
    ],
)
def test_lengths_that_cannot_be_driven_are_refused(tangents_m, goal, says):
    with pytest.raises(PlanningError, match=says):
        CubicPath(tangents_m).between(ORIGIN, goal, WAFFLE)


@given(headings)
def test_a_given_length_is_kept(heading):
    goal = PathPose(3.0, 0.5, 0.3)
    turned = ORIGIN.moved(0j, heading)
    moved = turned.moved(goal.point, goal.heading_rad)
    rates = CubicPath((2.0, 3.0)).between(turned, moved, WAFFLE).progress
    assert rates is not None
    assert (rates.rate_m[0], rates.rate_m[-1]) == pytest.approx((2.0, 3.0))
