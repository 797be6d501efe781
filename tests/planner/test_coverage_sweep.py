"""Covered ground: the raster against exact polygons, a known gap, and the ground that can be reached at all."""

import math

import numpy as np
import pytest
import shapely

from tests.planner.coverage_fields import PAN, ROLLER
from touchline.core.tool_reach import reachable
from touchline.services.planner.collision.checker import first_touch
from touchline.services.planner.coverage.coverage_raster import CoverageRaster
from touchline.services.planner.coverage.free_space import FreeSpace
from touchline.services.planner.coverage.kernels.grid import (
    BEND_STEP_M,
    ROUGH_OFF_M,
    ROUGH_STEP_M,
    begin_query,
    pass_path,
)
from touchline.services.planner.coverage.kernels.wall_clearance import keeps_off, poses_along
from touchline.services.planner.coverage.swept_area import body_at, body_outside_m, swept
from touchline.services.planner.coverage.zigzag import zigzag
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath

pytestmark = pytest.mark.xdist_group("coverage")  # its kernels are compiled in one worker


def test_the_raster_and_exact_polygons_agree() -> None:
    route = zigzag(PAN, ROLLER)
    counted = CoverageRaster(PAN, ROLLER.width_m, 0.025)
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
    counted = CoverageRaster(covered.convex_hull, 2.2, 0.025)
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


def _bends(rng: np.random.Generator) -> PiecePath:
    pieces = tuple(Piece(float(length), float(rng.uniform(-0.27, 0.27))) for length in rng.uniform(0.5, 6.0, 4))
    return PiecePath(PathPose(*rng.uniform((2.0, 2.0, -3.0), (18.0, 18.0, 3.0)).tolist()), pieces)


def test_asking_finds_what_counting_finds_and_what_is_taken_back_is_as_before() -> None:
    rng = np.random.default_rng(5)
    field = shapely.Polygon([(0, 0), (20, 0), (20, 8), (9, 9), (8, 20), (0, 20)])
    counted = CoverageRaster(field, ROLLER.width_m)
    paths = [_bends(rng) for _ in range(12)]
    for path in paths:
        missed_m2 = counted.missed_m2
        asked_m2 = counted.add(path, 0)
        assert counted.missed_m2 == missed_m2
        assert counted.add(path) == asked_m2 == pytest.approx(missed_m2 - counted.missed_m2, abs=1e-9)
        assert counted.missed_m2 == float(np.count_nonzero(counted.grid.wanted & (counted.grid.passes == 0))) * (
            counted.grid.cell_m**2
        )
    for path in paths:
        counted.take(path)
    assert not counted.grid.passes.any()
    assert counted.missed_m2 == counted.wanted_m2


def test_what_long_steps_along_bends_miss_is_within_what_is_allowed_for() -> None:
    rng = np.random.default_rng(6)
    grid = CoverageRaster(shapely.box(-20.0, -20.0, 40.0, 40.0), ROLLER.width_m).grid
    differing = 0
    for path in [_bends(rng) for _ in range(40)]:
        table, cells = np.array(path.pieces, dtype=np.float64), []
        for step_m in (BEND_STEP_M, ROUGH_STEP_M):
            begin_query(grid)
            cells.append(pass_path(np.array(path.start), table, len(table), grid, 0, step_m))
        fine_m2, rough_m2 = (count * grid.cell_m**2 for count in cells)
        assert fine_m2 <= rough_m2 + ROUGH_OFF_M * path.length_m
        differing += fine_m2 != rough_m2
    assert differing > 20


def test_a_body_that_leaps_where_it_is_well_off_touches_what_one_touches_that_is_looked_at_everywhere() -> None:
    rng = np.random.default_rng(7)
    field = shapely.Polygon([(0, 0), (20, 0), (20, 8), (9, 9), (8, 20), (0, 20)])
    walls = FreeSpace(field, [shapely.box(4.0, 4.0, 4.3, 4.3)], ROLLER, 0.05).walls
    poses, answers = np.empty((400, 3)), []
    for _ in range(120):
        path = _bends(rng)
        table = np.array(path.pieces, dtype=np.float64)
        along = poses[: poses_along(np.array(path.start), table, len(table), poses)]
        touched = first_touch(along, walls.edges, walls.owner, True, walls.body, walls.margin_m)[0]
        if touched == 0:
            continue
        answers.append(touched < 0)
        assert keeps_off(along, walls) == (touched < 0)
    assert 0 < sum(answers) < len(answers)


def test_how_far_the_body_keeps_inside_is_that_of_its_nearest_place() -> None:
    paths = [PiecePath(PathPose(-40.0, y, 0.0), (Piece(60.0),)) for y in (0.0, 22.0, 10.0)]
    assert body_outside_m(paths, ROLLER, PAN) == pytest.approx(-(23.8 - 22.0 - 1.1))
    beyond = PiecePath(PathPose(-40.0, 22.9, 0.0), (Piece(60.0),))
    assert body_outside_m([*paths, beyond], ROLLER, PAN) == pytest.approx(22.9 + 1.1 - 23.8)


def test_ground_beside_the_places_of_a_body_is_not_reached() -> None:
    """At one heading the two have an edge in common, which is no area."""
    body = [(0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)]
    free, beside = shapely.box(0.0, 0.0, 10.0, 10.0), shapely.box(9.5, 0.0, 12.0, 10.0)
    assert reachable(free, free, body, (0.0, 0.0), 0.5, home=beside).area == 0.0
