"""What is covered: the raster against exact polygons, a known gap, and what can be reached at all."""

import math

import numpy as np
import pytest
import shapely

from tests.planner.coverage_fields import PAN, ROLLER
from touchline.services.core.tool_reach import reachable
from touchline.services.planner.coverage.drum_sweep import body_at, swept
from touchline.services.planner.coverage.free_space import FreeSpace
from touchline.services.planner.coverage.stroke_map import StrokeMap
from touchline.services.planner.coverage.zigzag import zigzag
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath

pytestmark = pytest.mark.xdist_group("coverage")  # its kernels are compiled in one worker


def test_the_raster_and_exact_polygons_agree() -> None:
    route = zigzag(PAN, ROLLER)
    counted = StrokeMap(PAN, ROLLER.width_m, 0.025)
    for piece in route.pieces:
        counted.add(piece.path)
    exact = swept([piece.path for piece in route.pieces], ROLLER.width_m).intersection(PAN).area
    assert (counted.wanted_m2 - counted.missed_m2) / PAN.area == pytest.approx(exact / PAN.area, abs=2e-4)


def test_a_gap_between_lanes_is_as_wide_as_it_is() -> None:
    lanes = [PiecePath(PathPose(0.0, y, 0.3), (Piece(50.0),)) for y in (0.0,)]
    aside = 2.3 * np.array((-math.sin(0.3), math.cos(0.3)))
    lanes.append(PiecePath(PathPose(float(aside[0]), float(aside[1]), 0.3), (Piece(50.0),)))
    covered = swept(lanes, 2.2)
    assert covered.convex_hull.area - covered.area == pytest.approx(0.1 * 50.0, rel=0.01)
    counted = StrokeMap(covered.convex_hull, 2.2, 0.025)
    assert sum(counted.add(lane) for lane in lanes) == pytest.approx(2 * 50.0 * 2.2, rel=0.01)
    assert counted.missed_m2 == pytest.approx(0.1 * 50.0, rel=0.01)
    counted.take(lanes[0])
    assert counted.missed_m2 == pytest.approx(2.3 * 50.0, rel=0.01)


def test_what_a_rectangle_keeps_from_the_roller_is_its_margin_and_its_corners() -> None:
    space = FreeSpace(PAN, [], ROLLER, 0.05)
    found = reachable(PAN, space.free, ROLLER.outline, (0.0, 0.0), ROLLER.width_m)
    inside = (93.0 - 0.1) * (47.6 - 0.1)
    # Slanting into a corner the drum's end gets into part of the 0.4 m by 0.4 m ahead of it.
    assert inside - 4 * 0.4**2 <= found.area <= inside
    assert found.area / PAN.area == pytest.approx(0.9967, abs=1e-4)


def test_free_places_are_those_at_which_the_body_is_free() -> None:
    rng = np.random.default_rng(3)
    field = shapely.Polygon([(0, 0), (20, 0), (20, 8), (9, 9), (8, 20), (0, 20)])
    post = shapely.box(4.0, 4.0, 4.3, 4.3)
    space = FreeSpace(field, [post], ROLLER, 0.05)
    for heading in rng.uniform(-math.pi, math.pi, 12).tolist():
        places = np.column_stack((rng.uniform(0.0, 20.0, (400, 2)), np.full(400, heading)))
        free = shapely.covers(space.free, body_at(places, ROLLER))
        found = shapely.intersects_xy(space.at(heading), places[:, 0], places[:, 1])
        assert np.count_nonzero(free != found) <= 1
