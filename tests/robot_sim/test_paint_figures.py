"""More of the paint's figures by hand: quantiles, widths, strokes that cross themselves, restored ledgers."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.robot_sim.strokes import EASTWARD, NORTHWARD, WIDTH, along, ledger_of, line, paint
from touchline.onboard.interface import Estimate
from touchline.schemas.curves import Curve
from touchline.schemas.trajectories import assemble, segment, turn, velocity
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.estimator_error import EstimatorError
from touchline.services.robot_sim.paint.ledger import PaintLedger
from touchline.services.robot_sim.paint.metrics import paint_metrics
from touchline.services.robot_sim.paint.targets import Target, nozzle_curve, start_pose
from touchline.services.robot_sim.world.body import STEPS
from touchline.services.robot_sim.world.world import TruePose


def sprayed(ledger, points, width):
    """Spray along points 1 ms apart with this share of the width at each, the valve closed before and after."""
    rows = np.column_stack((points, np.broadcast_to(width, len(points))))
    rows[0, 2] = 0.0
    rows = np.vstack((rows, [[*points[-1], 0.0]] * (-(len(rows) - 1) % STEPS + STEPS)))
    for first in range(0, len(rows) - STEPS, STEPS):
        ledger.record(rows[first : first + STEPS + 1].copy())
    return ledger


def test_a_twentieth_of_the_ticks_is_beyond_the_95th_percentile():
    """93 % of the way 1 cm off, the rest 3 cm: the 90th percentile is 1 cm, the 95th is 3."""
    ledger = ledger_of(EASTWARD)
    paint(ledger, line((0, 0.01), (9.3, 0.01)))
    paint(ledger, line((9.3, -0.03), (10, -0.03)))
    lateral = paint_metrics(ledger).lateral
    assert (lateral.p95_m, lateral.max_m) == pytest.approx((0.03, 0.03))
    assert lateral.mean_m == pytest.approx(0.93 * 0.01 + 0.07 * 0.03, abs=1e-4)
    more = paint(ledger_of(EASTWARD), line((0, 0.01), (9.7, 0.01)))
    assert paint_metrics(paint(more, line((9.7, -0.03), (10, -0.03)))).lateral.p95_m == pytest.approx(0.01)


def test_lines_narrower_than_the_paint_are_overpainted_on_both_sides_and_covered_by_their_own_width():
    ledger = PaintLedger([Target("a", EASTWARD)], 0.08, 0.12)
    metrics = paint_metrics(paint(ledger, line((0, 0), (10, 0))))
    assert metrics.overspray_m2 == pytest.approx(10 * 0.04, abs=1e-6)
    assert metrics.segments[0].width_m == pytest.approx(0.12)
    beside = PaintLedger([Target("a", EASTWARD)], 0.08, 0.12)
    assert paint_metrics(paint(beside, line((0, 0.045), (10, 0.045)))).coverage_pct == 0.0
    wide = PaintLedger([Target("a", EASTWARD)], 0.16, 0.12)
    metrics = paint_metrics(paint(wide, line((0, 0.07), (10, 0.07))))
    assert metrics.coverage_pct == pytest.approx(100.0)
    assert metrics.overspray_m2 == pytest.approx(10 * 0.05, abs=1e-6)


def test_the_painted_length_is_what_was_driven_spraying_wherever_that_was():
    ledger = paint(ledger_of(EASTWARD), line((0, 0), (10, 0)))
    paint(ledger, line((5, 0), (7, 0)))
    paint(ledger, line((0, 50), (3, 54)))
    metrics = paint_metrics(ledger)
    assert metrics.painted_length_m == pytest.approx(10 + 2 + 5)
    assert metrics.template_length_m == 10.0
    assert metrics.overspray_m2 == pytest.approx(5 * WIDTH, abs=1e-6)
    assert metrics.segments[0].areas.painted_m2 == pytest.approx(10 * WIDTH), "paint far away belongs to no line"


def test_short_arcs_painted_in_one_go_are_as_wide_as_their_paint():
    """Ticks of 9.7 mm do not end where one line joins the next."""
    pieces, x, y, heading = [], 0.0, 0.0, 0.0
    for curvature in (1.0, -1.0, 0.5, 1.0, -0.5):
        pieces.append(Curve(x, y, heading, curvature, 0.0873))
        x, y, heading = pieces[-1].end
    ends = np.cumsum([0.0] + [piece.length_m for piece in pieces])
    at = np.arange(0.0, ends[-1], 0.00097)
    which = np.searchsorted(ends, at, side="right") - 1
    way = [[float(value) for value in pieces[i].at(s - ends[i])[:2]] for i, s in zip(which, at, strict=True)]
    metrics = paint_metrics(paint(ledger_of(*pieces), way))
    assert [segment.width_m for segment in metrics.segments] == pytest.approx([WIDTH] * 5, rel=0.01)


def test_a_line_painted_twice_beside_itself_is_wider_and_a_circle_beyond_its_end_is_not():
    ledger = paint(paint(ledger_of(EASTWARD), line((0, 0), (10, 0))), line((2, 0.02), (8, 0.02)))
    assert paint_metrics(ledger).segments[0].width_m == pytest.approx(WIDTH + 0.6 * 0.02, abs=1e-4)
    circle = Curve.from_arc((2.0, 0.0), (0.0, 0.0), 2 * math.pi)
    once = paint(ledger_of(circle), along(circle))
    assert paint_metrics(once).segments[0].width_m == pytest.approx(WIDTH, rel=2e-3)


def test_three_passes_are_as_much_double_paint_as_two():
    ledger = ledger_of(EASTWARD)
    for first, last in ((0, 10), (5, 7), (5, 7), (6, 8)):
        paint(ledger, line((first, 0), (last, 0)))
    assert paint_metrics(ledger).double_paint_m2 == pytest.approx(3 * WIDTH, abs=1e-6)


def test_a_stroke_that_crosses_itself_is_painted_twice_there():
    """East, three quarters of a circle to the left, and south across the beginning at a right angle."""
    loop = Curve.from_arc((6.0, 0.0), (6.0, 2.0), 1.5 * math.pi)
    way = np.vstack((line((0, 0), (6, 0)), along(loop)[1:], line((4.0, 2.0), (4.0, -2.0))[1:]))
    metrics = paint_metrics(paint(ledger_of(NORTHWARD), way))
    assert metrics.double_paint_m2 == pytest.approx(WIDTH**2, abs=1e-4)


def test_a_spiral_twice_round_is_painted_once_where_it_does_not_touch_itself():
    angle = np.linspace(0, 4 * math.pi, 20_001)
    radius = 1.0 + angle / (2 * math.pi) * 2 * WIDTH
    points = np.column_stack((radius * np.cos(angle), radius * np.sin(angle)))
    metrics = paint_metrics(sprayed(ledger_of(NORTHWARD), points, 1.0))
    length = np.hypot(*np.diff(points, axis=0).T).sum()
    assert metrics.painted_m2 == pytest.approx(length * WIDTH, rel=2e-3)
    assert metrics.double_paint_m2 < 2e-3


def test_paint_belongs_to_the_nearest_line_that_it_follows():
    """Of two parallel lines, whichever comes first in the template; and one across at 60° does not count."""
    near, far = Curve.from_line((0, 0.1), (10, 0.1)), Curve.from_line((0, -0.2), (10, -0.2))
    across = Curve.from_line((5, 0), (5 + 10 * math.cos(math.pi / 3), 10 * math.sin(math.pi / 3)))
    for lines in ((near, far, across), (across, far, near)):
        ledger = paint(ledger_of(*lines), line((0, 0), (10, 0)))
        assert set(ledger.deviation().target.tolist()) == {lines.index(near)}
        assert paint_metrics(ledger).lateral.max_m == pytest.approx(0.1)
    alone = paint(ledger_of(across), line((0, 0), (10, 0)))
    assert len(alone.deviation().target) == 0


def test_paint_beyond_a_lines_end_belongs_to_it_for_half_a_width_and_covers_nothing():
    ledger = paint(ledger_of(EASTWARD), line((0, 0.02), (11, 0.02)))
    ticks = ledger.deviation().target
    assert len(ticks) == pytest.approx(1000 + 0.5 * WIDTH / 0.01, abs=1)
    assert ledger.covered_m == pytest.approx(10.0)


@given(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))
def test_a_stroke_across_a_band_covers_the_part_within_it(first, last):
    """Its distance goes linearly from one to the other over 10 m; covered is where it is within half a width."""
    ledger = paint(ledger_of(EASTWARD), line((0, first), (10, last), step=0.01))
    sampled = np.abs(np.linspace(first, last, 100_001)) <= 0.5 * WIDTH
    assert ledger.covered_m == pytest.approx(10 * sampled.mean(), abs=2e-3)


@pytest.mark.parametrize("first_m", [0.0, 9.0, 27.0, 50.0])
@pytest.mark.parametrize("sweep", [2 * math.pi, -2 * math.pi, 1.5 * math.pi, -1.5 * math.pi])
@pytest.mark.parametrize("painted_m", [7.0, 2 * math.pi * 9.15])
def test_on_a_circle_what_is_passed_is_covered_wherever_it_begins(first_m, sweep, painted_m):
    """In ticks of 10 cm, which step over its ends, and over the place opposite the middle of an arc."""
    circle = Curve.from_arc((9.15, 0.0), (0.0, 0.0), sweep)
    way = np.arange(first_m, first_m + painted_m, 0.01)
    ledger = paint(ledger_of(circle), np.column_stack(circle.at(way)[:2]))
    passed = np.unique(np.round(np.mod(way, 2 * math.pi * 9.15), 2))
    assert ledger.covered_m == pytest.approx(0.01 * (passed < circle.length_m).sum(), abs=0.03)


def mixed(ledger):
    """Strokes of three widths, on two lines and off them."""
    sprayed(ledger, line((0, 0.01), (4, 0.01)), np.where(np.arange(4001) < 2000, 1.0, 0.5))
    sprayed(ledger, line((5, -0.02), (7, -0.02)), 0.7)
    return sprayed(ledger, line((0.03, 1), (0.03, 3)), 1.0)


def test_a_restored_ledger_has_the_same_figures_and_begins_a_new_stroke():
    whole = mixed(ledger_of(EASTWARD, NORTHWARD))
    for rows in (whole.rows(0), whole.rows(0)[:150]):
        again = ledger_of(EASTWARD, NORTHWARD)
        again.restore(rows.copy())
        assert np.array_equal(again.rows(0), rows)
    again = ledger_of(EASTWARD, NORTHWARD)
    again.restore(whole.rows(0).copy())
    assert paint_metrics(again) == paint_metrics(whole)
    # Another process goes on elsewhere with the valve open at once: what is between is not paint.
    again.record(np.column_stack((line((8, 0), (8.01, 0)), np.ones(11))))
    assert len(again.strokes()) == len(whole.strokes()) + 1
    assert paint_metrics(again).painted_length_m == pytest.approx(paint_metrics(whole).painted_length_m + 0.01)


def test_a_nozzle_before_or_behind_the_axle_draws_there():
    ahead = Vehicle(tool={"nozzle_x_m": 0.3, "nozzle_y_m": 0.0})
    east = nozzle_curve(segment("s", EASTWARD, 1), 1.0, 4.0, ahead)
    assert (east.x_m, east.y_m, east.length_m) == pytest.approx((1.3, 0.0, 3.0))
    left = Curve.from_arc((0.0, -2.0), (0.0, 0.0), math.pi)
    drawn = nozzle_curve(segment("s", left, 1), 0.0, left.length_m, ahead)
    x, y, *_ = drawn.at(np.linspace(0.0, drawn.length_m, 9))
    assert (drawn.x_m, drawn.y_m) == pytest.approx((0.3, -2.0))
    assert np.hypot(x, y) == pytest.approx(math.hypot(2.0, 0.3))
    backward = nozzle_curve(segment("s", EASTWARD, -1), 0.0, 10.0, ahead)
    assert (backward.x_m, backward.y_m) == pytest.approx((-0.3, 0.0)), "it looks the other way"


@pytest.mark.parametrize(("turned", "before"), [((math.pi / 2,), -math.pi / 2), ((-1.0, 0.3), 0.7)])
def test_a_plan_that_begins_with_turns_begins_turned_back(turned, before):
    spins = [turn(f"t{i}", 0.0, 0.0, angle) for i, angle in enumerate(turned)]
    plan = assemble([*spins, segment("s0", EASTWARD, 1)], [], [velocity(0.0, 0.0), velocity(10.0, 0.0)])
    assert start_pose(plan) == pytest.approx((0.0, 0.0, before))


def test_the_estimators_error_counts_from_the_first_motion_on_and_the_short_way_round():
    error = EstimatorError()

    def add(speed_mps, east_m, north_m, heading_rad):
        error.add(
            TruePose(1.0, 2.0, 3.0), speed_mps, Estimate(1.0 + east_m, 2.0 + north_m, heading_rad, 0.0, 0.0, None, None)
        )

    add(0.0, 9.0, 9.0, 0.0)
    assert (error.position_rmse_m, error.heading_rmse_rad) == (0.0, 0.0)
    add(-0.5, 0.3, 0.4, 3.1)
    add(0.0, 0.0, 0.0, 3.1 - 4 * math.pi)  # stands again, and counts
    assert error.position_rmse_m == pytest.approx(math.sqrt(0.25 / 2))
    assert error.heading_rmse_rad == pytest.approx(0.1)
