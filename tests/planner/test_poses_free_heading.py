"""The shortest path to a place, whatever the heading there."""

import math

import numpy as np
import pytest
from hypothesis import given

from tests.planner.strategies import floats, poses
from touchline.schemas.messages import PlanOptions
from touchline.schemas.vehicles.shipped import SHIPPED
from touchline.services.planner.geometry.clothoid import PathPose, PiecePath
from touchline.services.planner.poses.dubins_paths import Bearing, DubinsPaths, to_point
from touchline.services.planner.poses.traveller import Traveller
from touchline.services.planner.steering.dubins import dubins_pieces

pytestmark = pytest.mark.xdist_group("poses")  # its kernels are compiled in one worker

ORIGIN = PathPose(0.0, 0.0, 0.0)
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


def test_dubins_says_which_heading_it_has_chosen():
    found = DubinsPaths().between(ORIGIN, PathPose(2.0, 1.0, math.nan), TRAVELLER)
    assert found.note.startswith(f"heading {found.path.end.heading_rad:.3f} rad")
    assert DubinsPaths().between(ORIGIN, PathPose(2.0, 1.0, 0.0), TRAVELLER).note == ""
