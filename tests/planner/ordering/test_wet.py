"""Wet paint: crossings are counted as they happen, avoided where that is cheap, refused where that is asked for."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.planner.drawn import drawn
from tests.planner.strategies import floats
from touchline.schemas.catalogue import load_template
from touchline.schemas.curves import Curve
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner import tour
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath
from touchline.services.planner.plan import plan
from touchline.services.planner.sequencing.wet_paint import BEGUN, SPEED, Wheels, wet_rows

VEHICLE = Vehicle()
WHEELS = Wheels.of(VEHICLE, 0.12, 900.0)
ACROSS = Curve.from_line((5.0, -5.0), (5.0, 5.0))


def crossings(path: PiecePath, line: Curve, begun_s: float = 100.0, line_begun_s: float = 0.0) -> int:
    rows = wet_rows([line])
    rows[0, BEGUN], rows[0, SPEED] = line_begun_s, 1.0
    return int(WHEELS.crossings(path, begun_s, path.length_m, rows).sum())


def test_two_wheels_and_two_casters_cross_a_line_once_each() -> None:
    assert crossings(PiecePath(PathPose(0.0, 0.0, 0.0), (Piece(10.0),)), ACROSS) == 4


def test_paint_that_is_dry_or_not_there_yet_is_not_crossed() -> None:
    straight = PiecePath(PathPose(0.0, 0.0, 0.0), (Piece(10.0),))
    assert crossings(straight, ACROSS, begun_s=2000.0) == 0
    assert crossings(straight, ACROSS, line_begun_s=200.0) == 0


def test_the_robot_straddles_or_passes_a_line_without_touching_it() -> None:
    along = Curve.from_line((0.0, 0.0), (10.0, 0.0))
    assert crossings(PiecePath(PathPose(0.0, 0.0, 0.0), (Piece(10.0),)), along) == 0
    assert crossings(PiecePath(PathPose(0.0, -VEHICLE.tool.nozzle_y_m, 0.0), (Piece(10.0),)), along) == 0
    # With the line under the right wheel, the caster on that side smears its edge as well.
    assert crossings(PiecePath(PathPose(0.0, VEHICLE.drive.half_track_m, 0.0), (Piece(10.0),)), along) == 2


@given(floats(-math.pi, math.pi), floats(1.0, 8.0), st.sampled_from([1.0, -1.0]), floats(0.5, 6.0))
def test_crossings_of_an_arc_are_those_of_points_along_it(
    turn: float, radius: float, side: float, sweep: float
) -> None:
    start = (radius * math.cos(turn), radius * math.sin(turn))
    arc = Curve.from_arc(start, (0.0, 0.0), side * min(sweep, 6.28))
    path = PiecePath(PathPose(-12.0, 0.35, 0.0), (Piece(24.0),))
    x = np.arange(-12.0, 12.0, 1e-3)
    expected = 0
    for ahead, left in WHEELS.contacts.tolist():
        track = x + ahead + 1j * (0.35 + left)
        radial = np.abs(np.abs(track) - radius) <= WHEELS.half_width_m
        angle = (side * (np.angle(track) - turn)) % math.tau
        over = radial & (angle <= abs(arc.curvature_1pm) * arc.length_m)
        expected += int(over[0]) + int((np.diff(over.astype(int)) > 0).sum())
    assert abs(crossings(path, arc) - expected) <= 2  # grazed ends may fall between two looks


def test_fewer_crossings_are_worth_some_time(monkeypatch: pytest.MonkeyPatch) -> None:
    template, fast = load_template("soccer-7"), PlanOptions(paint_speed_mps=1.5, transit_speed_mps=2.0)
    careful = plan(template, VEHICLE, fast).report
    monkeypatch.setattr(tour, "CROSSING_S", 0.0)
    careless = plan(template, VEHICLE, fast).report
    assert careful.wet_crossings < careless.wet_crossings
    assert careless.total_time_s <= careful.total_time_s + 1e-6
    assert careful.total_time_s - careless.total_time_s < careless.wet_crossings - careful.wet_crossings
    assert plan(template, VEHICLE, PlanOptions(drying_time_s=1e-3)).report.wet_crossings == 0


def test_hard_drying_is_kept_or_refused_with_both_lines() -> None:
    apart = drawn(*((0.0, 3.0 * k, 8.0, 3.0 * k) for k in range(3)))
    assert plan(apart, VEHICLE, PlanOptions(hard_drying=True)).report.wet_crossings == 0
    cross = drawn((0.0, 0.0, 8.0, 0.0), (4.0, -4.0, 4.0, 4.0))
    with pytest.raises(PlanningError, match=r"cannot be painted without driving over .* while that is wet; shorten"):
        plan(cross, VEHICLE, PlanOptions(hard_drying=True))
    quick = PlanOptions(hard_drying=True, drying_time_s=1.0)
    assert plan(cross, VEHICLE, quick).report.wet_crossings == 0


def test_hard_drying_finds_the_one_order_without_a_crossing() -> None:
    """Rungs end on both rails: they are painted first, and the rails so that the wheels are outside."""
    rungs, rails = [(4.0 * k, 0.0, 4.0 * k, 5.0) for k in range(3)], [(-2.0, y, 10.0, y) for y in (0.0, 5.0)]
    ladder = drawn(*rails, *rungs)
    assert plan(ladder, VEHICLE, PlanOptions(order="given")).report.wet_crossings > 0
    report = plan(ladder, VEHICLE, PlanOptions(hard_drying=True)).report
    assert (report.wet_crossings, report.wet_crossings_unavoidable) == (0, 0)


def test_a_turn_on_the_spot_runs_over_what_its_casters_sweep() -> None:
    beside = Curve.from_line((0.3, 0.3), (0.6, 0.6))
    assert crossings(PiecePath(PathPose(-5.0, 0.0, 0.0), (Piece(5.0),)), beside) == 0
    turned = PiecePath(PathPose(-5.0, 0.0, 0.0), (Piece(5.0), Piece.spin(math.pi / 2)))
    assert crossings(turned, beside) == 2


@pytest.mark.parametrize("seconds", [-1.0, math.inf, math.nan])
def test_an_unusable_drying_time_is_refused(seconds: float) -> None:
    options = PlanOptions.model_construct(**{**PlanOptions().model_dump(), "drying_time_s": seconds})
    with pytest.raises(PlanningError, match="drying_time_s"):
        plan(load_template("study-square"), VEHICLE, options)
