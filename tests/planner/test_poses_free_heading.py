"""The shortest path to a place, whatever the heading there."""

import math

import numpy as np
import pytest
from hypothesis import given

from tests.planner.strategies import floats, poses
from touchline.schemas.messages import PlanOptions
from touchline.schemas.vehicles.shipped import SHIPPED
from touchline.services.planner.geometry.clothoid import PathPose, PiecePath
from touchline.services.planner.poses.dubins_paths import Bearing, DubinsPaths, ToPoint, to_point
from touchline.services.planner.poses.kernels.free_heading import shortest_lengths
from touchline.services.planner.poses.traveller import Traveller
from touchline.services.planner.steering.dubins import dubins_pieces

pytestmark = pytest.mark.xdist_group("poses")  # its kernels are compiled in one worker

ORIGIN = PathPose(0.0, 0.0, 0.0)
shortest = shortest_lengths.py_func  # calls the kernel that paths are made with
TRAVELLER = Traveller.of(SHIPPED["turtlebot2"].vehicle, PlanOptions())
RADIUS_M = 0.3


def dubins_m(start, goal):
    return PiecePath(start, dubins_pieces(start, goal, 1.0 / RADIUS_M)).length_m


@given(poses, poses)
def test_it_leads_there_and_is_no_longer_than_with_any_heading(start, goal):
    path = to_point(start, goal, 1.0 / RADIUS_M)
    assert abs(path.end.point - goal.point) < 1e-9
    for heading in np.arange(16) * math.tau / 16.0:
        assert path.length_m <= dubins_m(start, goal._replace(heading_rad=heading)) + 1e-9


def test_it_is_as_long_as_the_least_of_all_headings():
    rng = np.random.default_rng(3)
    for x, y in rng.uniform(-1.2, 1.2, (10, 2)).tolist():
        ((length, heading),) = shortest(np.array([[x, y]]), RADIUS_M).tolist()
        assert dubins_m(ORIGIN, PathPose(x, y, heading)) == pytest.approx(length, abs=1e-9)
        sampled = [dubins_m(ORIGIN, PathPose(x, y, a)) for a in np.linspace(0.0, math.tau, 121)]
        assert length <= min(sampled) + 1e-9
        assert min(sampled) - length < 0.02


@pytest.mark.parametrize(
    ("x_m", "y_m", "length_m"),
    [
        (0.0, 0.0, 0.0),
        (2.0, 0.0, 2.0),
        (0.0, 0.6, 0.3 * math.pi),
        (0.0, -0.6, 0.3 * math.pi),
        (0.3, 0.3, 0.3 * math.pi / 2.0),
    ],
)
def test_known_lengths(x_m, y_m, length_m):
    assert shortest(np.array([[x_m, y_m]]), RADIUS_M)[0, 0] == pytest.approx(length_m, abs=1e-12)


def test_a_place_inside_a_turning_circle_is_reached_from_the_other_side():
    for y in (0.3, -0.3):
        path = to_point(ORIGIN, PathPose(0.0, y, 0.0), 1.0 / RADIUS_M)
        assert [math.copysign(1.0, piece.curvature_1pm * y) for piece in path.pieces] == [-1.0, 1.0]


@given(floats(-10.0, 10.0), floats(-10.0, 10.0), floats(-3.0, 3.0))
def test_bearing_looks_along_the_chord(x, y, heading):
    start, goal = PathPose(1.0, -2.0, heading), PathPose(x, y, math.nan)
    end = Bearing().between(start, goal, TRAVELLER).path.end
    wanted = math.atan2(y + 2.0, x - 1.0) if abs(complex(x - 1.0, y + 2.0)) else heading
    assert abs(math.remainder(end.heading_rad - wanted, math.tau)) < 1e-9


def test_bearing_at_the_place_itself_keeps_the_heading():
    start = PathPose(1.0, 1.0, 0.7)
    assert Bearing().between(start, start._replace(heading_rad=math.nan), TRAVELLER).path.length_m == 0.0


def test_bearing_may_take_two_turning_circles_more():
    rng = np.random.default_rng(7)
    longest = 0.0
    for x, y in rng.uniform(-1.0, 1.0, (300, 2)).tolist():
        goal = PathPose(x, y, math.nan)
        longest = max(
            longest,
            Bearing().between(ORIGIN, goal, TRAVELLER).path.length_m
            - ToPoint().between(ORIGIN, goal, TRAVELLER).path.length_m,
        )
    assert longest == pytest.approx(2.0 * math.pi * RADIUS_M, rel=0.05)


def test_dubins_says_which_heading_it_has_chosen():
    found = DubinsPaths().between(ORIGIN, PathPose(2.0, 1.0, math.nan), TRAVELLER)
    assert found.note.startswith(f"heading {found.path.end.heading_rad:.3f} rad")
    assert DubinsPaths().between(ORIGIN, PathPose(2.0, 1.0, 0.0), TRAVELLER).note == ""
