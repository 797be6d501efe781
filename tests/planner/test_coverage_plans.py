"""Covering whole fields: what is asked of the salt pan, and that nothing is left or touched elsewhere."""

import math
from typing import Any

import numpy as np
import pytest
import shapely

from tests.planner.coverage_fields import PAN, ROLLER, covered_pct
from touchline.schemas.errors import PlanningError
from touchline.services.planner.coverage.coverage_route import CoverageRoute
from touchline.services.planner.coverage.coverage_task import CoverageTask
from touchline.services.planner.coverage.lap_and_lanes import cover
from touchline.services.planner.coverage.swept_area import body_outside_m
from touchline.services.planner.geometry.clothoid import PathPose

pytestmark = pytest.mark.xdist_group("coverage")  # its kernels are compiled in one worker


def asked(field: shapely.Polygon, *obstacles: shapely.Polygon, **options: Any) -> CoverageTask:
    """To cover a field within its own outline."""
    return CoverageTask(field, field, obstacles, ROLLER, **options)


def check(route: CoverageRoute, free: shapely.Polygon) -> None:
    """Pieces follow each other, keep the limits of steering, and the body keeps inside."""
    assert body_outside_m([piece.path for piece in route.pieces], ROLLER, free) <= 0.0
    curvature, direction, at = 0.0, route.pieces[0].direction, route.pieces[0].path.start
    for drive in route.pieces:
        assert abs(drive.path.start.point - at.point) < 1e-6
        assert abs(math.remainder(drive.path.start.heading_rad - at.heading_rad, math.tau)) < 1e-6
        for piece in drive.path.pieces:
            assert piece.direction == drive.direction
            assert abs(piece.sharpness_1pm2) <= ROLLER.sharpness_max_1pm2 + 1e-9
            assert max(abs(piece.curvature_1pm), abs(piece.curvature_end_1pm)) <= ROLLER.curvature_max_1pm + 1e-9
            if piece.direction == direction:
                assert abs(piece.curvature_1pm - curvature) < 1e-9
            curvature, direction = piece.curvature_end_1pm, piece.direction
        at = drive.path.end


def test_the_pan_forward_only() -> None:
    route = cover(asked(PAN, forward_only=True))
    check(route, PAN)
    assert route.cusps == 0
    assert covered_pct(route, PAN) >= 98.9
    assert covered_pct(route, route.reachable) >= 99.2
    assert route.seconds(ROLLER) <= 37.0 * 60.0
    assert route.remarks == ()


@pytest.mark.full
def test_the_pan_with_cusped_corners() -> None:
    route = cover(asked(PAN))
    check(route, PAN)
    assert covered_pct(route, PAN) >= 99.4
    assert covered_pct(route, route.reachable) >= 99.75
    assert route.seconds(ROLLER) <= 39.0 * 60.0


def test_any_polygon_is_covered_with_nothing_touched() -> None:
    rng = np.random.default_rng(1)
    angles = (np.arange(6) + rng.uniform(-0.2, 0.2, 6)) * math.tau / 6
    radii = rng.uniform(11.0, 14.0, 6)
    outline = np.column_stack((radii * np.cos(angles), radii * np.sin(angles)))
    post = shapely.box(2.0, 3.0, 2.4, 3.4)
    field = shapely.Polygon(outline)
    # Touching up takes longest: it is left out here.
    route = cover(asked(field, post, coverage_pct=97.0))
    check(route, field.difference(post))
    assert covered_pct(route, route.reachable) >= 97.0


def test_what_cannot_be_covered_is_refused_with_the_remedy() -> None:
    with pytest.raises(PlanningError, match=r"no room for a single straight.*enlarge"):
        cover(asked(shapely.box(0.0, 0.0, 10.0, 2.0)))


@pytest.mark.full
def test_a_strip_in_which_the_machine_cannot_turn_is_driven_both_sides() -> None:
    strip = shapely.box(0.0, 0.0, 20.0, 4.4)
    route = cover(asked(strip, coverage_pct=80.0))
    check(route, strip)
    assert covered_pct(route, route.reachable) >= 80.0


def test_what_lies_behind_a_wall_is_left_out_and_said() -> None:
    field, wall = shapely.box(0.0, 0.0, 28.0, 13.0), shapely.box(15.0, -1.0, 16.0, 14.0)
    route = cover(asked(field, wall, laps=0, coverage_pct=80.0))
    check(route, field.difference(wall))
    assert not any(piece.kind == "lap" for piece in route.pieces)
    near = route.reachable.intersection(shapely.box(0.0, 0.0, 15.0, 13.0))
    assert covered_pct(route, near) >= 80.0
    assert "m² are left out: the passage to them is too narrow" in route.remarks[-1]


def test_every_straight_is_driven_or_said_to_be_left_out() -> None:
    route = cover(asked(shapely.box(0.0, 0.0, 22.0, 16.0), laps=2, coverage_pct=85.0))
    driven = {piece.label for piece in route.pieces if piece.kind in ("lap", "lane")}
    left_out = next(remark for remark in route.remarks if remark.startswith("left out, as turns"))
    told = set(left_out.partition(": ")[2].split("; "))
    sides = {f"{lap}, side {number}" for lap in ("lap", "lap 2") for number in range(1, 5)}
    lanes = {f"lane {number}" for number in range(1, max(int(label[5:]) for label in driven - sides) + 1)}
    assert not driven & told
    assert driven | told >= sides | lanes


def test_laps_that_do_not_fit_are_told() -> None:
    route = cover(asked(shapely.box(0.0, 0.0, 22.0, 12.0), laps=6, coverage_pct=50.0))
    assert route.remarks[0] == "6 laps are asked for, 3 fit: there is no room further in"


def test_an_area_narrower_than_the_tool_is_covered() -> None:
    strip = shapely.box(0.0, 0.0, 20.0, 1.0)
    route = cover(CoverageTask(strip, shapely.box(-9.0, -9.0, 29.0, 9.0), (), ROLLER))
    assert covered_pct(route, strip) >= 99.9


@pytest.mark.parametrize(
    "start",
    [
        PathPose(12.0, 1.135, 0.0),  # beside a wall, where it cannot turn away at once
        PathPose(2.6, 7.0, 0.0),  # its tail at a wall
        pytest.param(PathPose(15.0, 7.0, 2.5), marks=pytest.mark.full),
    ],
)
def test_what_is_left_is_covered_from_where_the_machine_stands(start: PathPose) -> None:
    field, left = shapely.box(0.0, 0.0, 24.0, 14.0), shapely.box(0.0, 8.0, 24.0, 14.0)
    route = cover(asked(field, start=start, remaining=left, coverage_pct=90.0))
    check(route, field)
    assert route.pieces[0].path.start == start
    assert covered_pct(route, left) >= 90.0
    assert route.length_m < 210.0, "all of the field takes 258 m"


def test_a_machine_that_stands_in_a_wall_cannot_begin() -> None:
    with pytest.raises(PlanningError, match=r"start pose \(x 1\.0 m, y 7\.0 m\) at which the body is out"):
        cover(asked(shapely.box(0.0, 0.0, 24.0, 14.0), start=PathPose(1.0, 7.0, 0.0)))


def test_small_ground_with_no_room_for_a_straight_is_touched_up_from_where_the_machine_stands() -> None:
    field, patch = shapely.box(0.0, 0.0, 24.0, 14.0), shapely.box(10.0, 6.0, 10.5, 6.5)
    route = cover(asked(field, start=PathPose(5.0, 3.0, 0.0), remaining=patch))
    assert covered_pct(route, patch) >= 99.0
    assert route.length_m < 60.0
