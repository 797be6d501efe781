"""Acceptance of paint, and the coverage of the area beside that of the length."""

import math

import numpy as np
import pytest

from tests.robot_sim.strokes import EASTWARD, NORTHWARD, WIDTH, along, ledger_of, line, paint
from touchline.schemas.curves import Curve
from touchline.services.robot_sim.paint.ledger import PaintLedger
from touchline.services.robot_sim.paint.metrics import paint_metrics
from touchline.services.robot_sim.paint.targets import Target


def judged(*shifts, length_m=10.0):
    """A line painted piece by piece, each as far off as `shifts` says."""
    ledger = ledger_of(EASTWARD)
    for index, shift in enumerate(shifts):
        first, last = (length_m * (index + end) / len(shifts) for end in (0, 1))
        paint(ledger, line((first, shift), (last, shift)))
    return paint_metrics(ledger)


def test_a_line_58_mm_off_is_covered_by_its_length_and_refused():
    metrics = judged(0.058)
    assert metrics.coverage_pct == pytest.approx(100.0)
    assert metrics.area_coverage_pct == pytest.approx(100 * (1 - 58 / 120), abs=0.01)
    assert metrics.within_pct == 0.0
    assert not metrics.verdict.accepted
    assert metrics.verdict.text.startswith("0.00 % of the length is painted within 30 mm, 99 % is asked for")


def test_nine_millimetres_off_cover_92_percent_of_the_area():
    metrics = judged(0.009, -0.009)
    assert metrics.area_coverage_pct == pytest.approx(92.5, abs=0.01)
    assert metrics.segments[0].area_coverage_pct == pytest.approx(92.5, abs=0.01)
    assert (metrics.coverage_pct, metrics.within_pct) == pytest.approx((100.0, 100.0))
    assert metrics.verdict.accepted


@pytest.mark.parametrize(("shift", "accepted"), [(0.0299, True), (0.0301, False), (-0.0301, False)])
def test_the_tolerance_is_3_cm_unless_the_template_says(shift, accepted):
    assert judged(shift).verdict.accepted is accepted
    wide = paint(PaintLedger([Target("a", EASTWARD)], WIDTH, WIDTH, tolerance_m=0.04), line((0, shift), (10, shift)))
    assert paint_metrics(wide).verdict.accepted


def test_a_short_line_that_is_missing_is_no_matter_of_a_hundredth_of_the_length():
    lines = [Curve.from_line((0.0, y), (50.0, y)) for y in range(4)] + [Curve.from_line((60.0, 0.0), (61.0, 0.0))]
    ledger = ledger_of(*lines)
    for curve in lines[:-1]:
        paint(ledger, along(curve))
    metrics = paint_metrics(ledger)
    assert metrics.within_pct > 99.5
    assert not metrics.verdict.accepted
    assert 'the worst line, "s4", lacks 1.000 m of it, 0.050 m is allowed' in metrics.verdict.text
    paint(ledger, line((60.0, 0.0), (60.96, 0.0)))
    assert paint_metrics(ledger).verdict.accepted, "4 cm of a short line are the valve's"


def test_what_lies_within_the_tolerance_counts_once_and_on_either_pass():
    ledger = paint(ledger_of(EASTWARD), line((0, 0.05), (10, 0.05)))
    for first, last in ((0, 6), (4, 8), (4.5, 5)):
        paint(ledger, line((first, 0.01), (last, 0.01)))
    assert ledger.within_by_target_m(0.03) == pytest.approx([8.0])
    assert ledger.within_by_target_m(0.06) == pytest.approx([10.0])
    assert ledger.within_by_target_m(0.06) == pytest.approx(ledger.covered_by_target_m)


def test_paint_of_a_neighbour_covers_area_and_a_crossing_line_no_length():
    ledger = paint(ledger_of(EASTWARD, NORTHWARD), line((0, 0), (10, 0)))
    across = paint_metrics(ledger).segments[1]
    assert across.areas.covered_m2 == pytest.approx(0.25 * WIDTH**2, abs=1e-6)
    assert across.within_m == pytest.approx(0.0, abs=1e-9)


def test_a_full_circle_within_the_tolerance():
    circle = Curve.from_arc((2.0, 0.0), (0.0, 0.0), 2 * math.pi)
    inside = paint(ledger_of(circle), along(circle, left=0.02))
    assert inside.within_by_target_m(0.03) == pytest.approx([circle.length_m], abs=0.01)
    assert paint_metrics(inside).area_coverage_pct == pytest.approx(100 * (0.1 / 0.12) * (1.99 / 2.0), abs=0.05)
    assert np.allclose(inside.within_by_target_m(0.01), 0.0)


def test_nothing_to_paint_is_accepted_and_nothing_painted_is_not():
    nothing = paint_metrics(PaintLedger([], WIDTH, WIDTH))
    assert nothing.verdict.accepted and nothing.area_coverage_pct == nothing.within_pct == 100.0
    bare = paint_metrics(ledger_of(EASTWARD))
    assert not bare.verdict.accepted and bare.area_coverage_pct == bare.within_pct == 0.0


@pytest.mark.parametrize(("painted_m", "accepted"), [(0.057, True), (0.054, False)])
def test_of_short_lines_the_valve_may_miss_5_mm_each(painted_m, accepted):
    lines = [Curve.from_line((0.0, y), (0.06, y)) for y in range(10)]
    ledger = ledger_of(*lines)
    for y in range(10):
        paint(ledger, line((0.0, y), (painted_m, y)))
    metrics = paint_metrics(ledger)
    assert metrics.verdict.accepted is accepted
    assert "all but 0.050 m of 0.60 m is asked for" in metrics.verdict.text


def test_a_whole_short_line_is_not_outweighed_by_what_the_valve_may_miss_of_the_others():
    lines = [Curve.from_line((0.0, y), (0.08, y)) for y in range(40)]
    ledger = ledger_of(*lines)
    for y in range(39):
        paint(ledger, line((0.0, y), (0.08, y)))
    assert not paint_metrics(ledger).verdict.accepted
