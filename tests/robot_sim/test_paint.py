"""Paint accounting against cases worked out by hand."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.robot_sim.scripted import trajectory
from tests.robot_sim.strokes import EASTWARD, NORTHWARD, WIDTH, along, ledger_of, line, paint
from touchline.core.intervals import Intervals
from touchline.schemas.curves import Curve
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.paint.cell_grid import cell_of, make_grid
from touchline.services.robot_sim.paint.metrics import paint_metrics
from touchline.services.robot_sim.paint.projection import REACH_M, project
from touchline.services.robot_sim.paint.targets import segment_length_m, sprayed_stretches, start_pose, targets
from touchline.services.robot_sim.world.body import STEPS


def test_an_exact_line():
    metrics = paint_metrics(paint(ledger_of(EASTWARD), line((0, 0), (10, 0))))
    assert metrics.coverage_pct == pytest.approx(100.0, abs=1e-9)
    assert metrics.gap_m == pytest.approx(0.0, abs=1e-9)
    assert metrics.overspray_m2 == pytest.approx(0.0, abs=1e-6)
    assert metrics.double_paint_m2 == 0.0
    assert metrics.lateral.max_m == pytest.approx(0.0, abs=1e-12)
    assert metrics.painted_length_m == pytest.approx(10.0)
    assert metrics.painted_m2 == pytest.approx(1.2)


def test_a_line_painted_2_cm_to_the_left():
    metrics = paint_metrics(paint(ledger_of(EASTWARD), line((0, 0.02), (10, 0.02))))
    assert metrics.coverage_pct == pytest.approx(100.0)
    assert metrics.overspray_m2 == pytest.approx(10 * 0.02, abs=1e-6)
    assert metrics.lateral.mean_m == pytest.approx(0.02)
    assert metrics.lateral.p95_m == pytest.approx(0.02)
    assert metrics.lateral.max_m == pytest.approx(0.02)


def test_paint_beyond_half_a_line_width_covers_nothing():
    metrics = paint_metrics(paint(ledger_of(EASTWARD), line((0, 0.0601), (10, 0.0601))))
    assert metrics.coverage_pct == 0.0
    assert metrics.gap_m == pytest.approx(10.0)
    assert metrics.lateral.mean_m == pytest.approx(0.0601)


def test_gaps_and_ends():
    ledger = ledger_of(EASTWARD)
    paint(ledger, line((0.005, 0), (4, 0)))
    paint(ledger, line((4.0123, 0), (10.03, 0)))
    metrics = paint_metrics(ledger)
    assert metrics.gap_m == pytest.approx(0.005 + 0.0123, abs=1e-9)
    assert metrics.coverage_pct == pytest.approx(100 * (10 - 0.0173) / 10)
    assert metrics.overspray_m2 == pytest.approx(0.03 * WIDTH, abs=1e-6)


def test_a_second_pass_is_double_paint_and_adds_no_coverage():
    ledger = ledger_of(EASTWARD)
    paint(ledger, line((0, 0), (10, 0)))
    paint(ledger, line((5, 0), (7, 0)))
    metrics = paint_metrics(ledger)
    assert metrics.coverage_pct == pytest.approx(100.0)
    assert metrics.double_paint_m2 == pytest.approx(2 * WIDTH, abs=1e-6)


def test_there_and_back_in_one_stroke_is_double_paint():
    ledger = paint(ledger_of(EASTWARD), np.vstack((line((0, 0), (5, 0)), line((5, 0), (3, 0))[1:])))
    assert paint_metrics(ledger).double_paint_m2 == pytest.approx(2 * WIDTH, abs=1e-6)


def test_passes_that_only_touch_are_not_double_paint_beside_one_that_overlaps():
    """A shared edge is a line, the overlap an area: both are in what the passes have in common."""
    ledger = paint(ledger_of(EASTWARD), line((0, 0), (10, 0)))
    paint(ledger, line((2, WIDTH), (4, WIDTH)))
    paint(ledger, line((6, WIDTH / 2), (7, WIDTH / 2)))
    assert paint_metrics(ledger).double_paint_m2 == pytest.approx(WIDTH / 2, abs=1e-6)


def test_crossing_lines_are_not_double_paint():
    ledger = ledger_of(EASTWARD, Curve.from_line((5, -3), (5, 3)))
    paint(ledger, line((0, 0), (10, 0)))
    paint(ledger, line((5, -3), (5, 3)))
    metrics = paint_metrics(ledger)
    assert metrics.double_paint_m2 == 0.0
    assert metrics.coverage_pct == pytest.approx(100.0)
    assert metrics.area_coverage_pct == pytest.approx(100.0)
    assert metrics.painted_m2 == pytest.approx(16 * WIDTH - WIDTH**2)
    assert metrics.lateral.max_m == pytest.approx(0.0, abs=1e-12)


def test_joined_corner_is_not_double_paint():
    ledger = ledger_of(EASTWARD, Curve.from_line((10, 0), (10, 5)))
    paint(ledger, line((0, 0), (10, 0)))
    paint(ledger, line((10, 0), (10, 5)))
    metrics = paint_metrics(ledger)
    assert metrics.double_paint_m2 == 0.0
    assert metrics.overspray_m2 == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("sweep", [2 * math.pi, -2 * math.pi])
def test_a_full_circle(sweep):
    circle = Curve.from_arc((9.15, 0.0), (0.0, 0.0), sweep)
    metrics = paint_metrics(paint(ledger_of(circle), along(circle)))
    assert metrics.coverage_pct == pytest.approx(100.0, abs=1e-6)
    assert metrics.lateral.max_m < 1e-4
    assert metrics.painted_m2 == pytest.approx(circle.length_m * WIDTH, rel=1e-3)
    assert metrics.overspray_m2 < circle.length_m * 1e-4
    assert metrics.double_paint_m2 < 1e-4


def test_painting_on_past_the_start_of_a_circle_is_double_paint():
    circle = Curve.from_arc((9.15, 0.0), (0.0, 0.0), 2 * math.pi)
    metrics = paint_metrics(paint(ledger_of(circle), along(circle, 0.0, circle.length_m + 1.0)))
    excused = 2 * WIDTH  # half a width of lengthening and half a width of growth: up to a width beyond the join
    assert metrics.double_paint_m2 == pytest.approx((1.0 - 0.5 * excused) * WIDTH, abs=2e-3)
    assert metrics.coverage_pct == pytest.approx(100.0)


def test_arc_painted_outside_its_radius():
    arc = Curve.from_arc((5.0, 0.0), (0.0, 0.0), math.pi / 2)
    metrics = paint_metrics(paint(ledger_of(arc), along(arc, left=-0.03)))
    assert metrics.coverage_pct == pytest.approx(100.0, abs=0.01)
    assert metrics.lateral.mean_m == pytest.approx(0.03, abs=1e-4)
    assert metrics.overspray_m2 == pytest.approx(0.25 * math.pi * (5.09**2 - 5.06**2), rel=0.01)


def test_paint_that_sways_on_the_spot_belongs_to_the_line_under_it():
    """A nozzle that creeps is moved sideways by the robot's corrections: not along another line 0.35 m away."""
    ledger = ledger_of(EASTWARD, Curve.from_line((5.0, -3.0), (5.0, 3.0)))
    paint(ledger, np.vstack((line((4.0, 0.0), (5.35, 0.0)), line((5.35, 0.0), (5.35, 0.003), step=5e-5)[1:])))
    deviation = ledger.deviation()
    assert set(deviation.target.tolist()) == {0}
    assert np.abs(deviation.lateral_m).max() == pytest.approx(0.003)


def test_paint_that_goes_along_a_line_beside_it_belongs_to_that():
    """However near to another that it crosses."""
    ledger = ledger_of(EASTWARD, Curve.from_line((5.0, -3.0), (5.0, 3.0)))
    paint(ledger, line((5.35, -1.0), (5.35, 1.0)))
    deviation = ledger.deviation()
    assert set(deviation.target.tolist()) == {1}
    assert np.abs(deviation.lateral_m) == pytest.approx(0.35)


def test_nothing_painted():
    metrics = paint_metrics(ledger_of(EASTWARD))
    assert metrics.coverage_pct == 0.0
    assert metrics.gap_m == 10.0
    assert metrics.lateral.max_m == metrics.overspray_m2 == metrics.double_paint_m2 == 0.0


def test_marks_join_and_are_numbered():
    ledger = ledger_of(EASTWARD)
    paint(ledger, line((0, 0), (0.105, 0)))
    first = ledger.take_marks()
    paint(ledger, line((0.2, 0), (0.33, 0)))
    second = ledger.take_marks()
    assert ledger.take_marks() == []
    assert [marks.first_index for marks in first + second] == [0, len(first[0].x_m)]
    assert first[0].x_m == pytest.approx([*np.arange(11) * 0.01, 0.105])
    assert first[0].target == 0
    for marks, again in zip(ledger.all_marks(), first + second, strict=True):
        assert marks.first_index == again.first_index
        assert np.array_equal(marks.x_m, again.x_m)


def test_marks_taken_in_the_middle_of_a_stroke_share_a_point():
    ledger = ledger_of(EASTWARD)
    points = np.column_stack((line((0, 0), (0.02, 0)), np.ones(21)))
    ledger.record(points[:11])
    (first,) = ledger.take_marks()
    ledger.record(points[10:])
    (second,) = ledger.take_marks()
    assert second.x_m[0] == first.x_m[-1]
    assert second.first_index == first.first_index + len(first.x_m) - 1
    assert len(ledger.all_marks()) == 1


def test_marks_are_cut_where_the_line_changes():
    ledger = ledger_of(Curve.from_line((0, 0), (1, 0)), Curve.from_line((1, 0), (1, 1)))
    paint(ledger, np.vstack((line((0, 0), (1, 0)), line((1, 0), (1, 1))[1:])))
    marks = ledger.take_marks()
    assert [mark.target for mark in marks] == [0, 1]
    assert marks[1].x_m[0] == marks[0].x_m[-1]
    assert marks[1].first_index == len(marks[0].x_m) - 1


ARC = st.builds(
    lambda x, y, heading, curvature, turn: Curve(x, y, heading, curvature, abs(turn / curvature)),
    st.floats(-50, 50),
    st.floats(-50, 50),
    st.floats(-4, 4),
    st.floats(0.05, 2).flatmap(lambda k: st.sampled_from([k, -k])),
    st.floats(0.1, 2 * math.pi - 0.2),
)
STRAIGHT = st.builds(Curve, st.floats(-50, 50), st.floats(-50, 50), st.floats(-4, 4), st.just(0.0), st.floats(0.1, 50))


@given(st.one_of(ARC, STRAIGHT), st.floats(0, 1), st.floats(-0.3, 0.3))
def test_projection_inverts_the_curve(curve, share, left):
    s = share * curve.length_m
    x, y, heading, _ = (float(value) for value in curve.at(s))
    table = np.array([curve.x_m, curve.y_m, curve.heading_rad, curve.curvature_1pm, curve.length_m])
    found = project(x - left * math.sin(heading), y + left * math.cos(heading), table)
    assert found == pytest.approx((s, left), abs=1e-6)


@given(st.lists(st.tuples(st.integers(0, 60), st.integers(0, 20)), max_size=30))
def test_intervals_measure_what_a_set_of_cells_measures(spans):
    intervals, cells = Intervals(), set()
    for start, length in spans:
        intervals.add(float(start), float(start + length))
        cells.update(range(start, start + length))
    assert intervals.length == len(cells)
    found = intervals.spans()
    assert all(a[1] < b[0] for a, b in itertools.pairwise(found))


def test_intended_paint_without_a_template_is_the_path_moved_to_the_nozzle():
    vehicle = Vehicle()
    arc = Curve.from_arc((10.0, 0.0), (10.0, 2.0), math.pi / 2)
    plan = trajectory([EASTWARD, arc, arc.reversed()], [True, True, True], directions=[1, 1, -1])
    east, left_turn, backward = (target.curve for target in targets(plan, None, vehicle))
    assert (east.x_m, east.y_m) == pytest.approx((0.0, -0.41124))
    assert east.length_m == pytest.approx(10.0)
    assert 1 / left_turn.curvature_1pm == pytest.approx(2.41124)
    assert 1 / backward.curvature_1pm == pytest.approx(-2.41124)
    assert backward.end[:2] == pytest.approx((left_turn.x_m, left_turn.y_m))


def test_targets_follow_the_path_and_end_with_what_it_leaves_out():
    template = Template(
        name="two",
        segments=[{"id": name, "line": {"start": (0, y), "end": (5, y)}} for y, name in enumerate("abc")],
    )
    plan = trajectory([EASTWARD, EASTWARD, EASTWARD], [True, False, True], ids=["c", "t0", "a"])
    assert [target.id for target in targets(plan, template, Vehicle())] == ["c", "a", "b"]


def test_sprayed_stretches_and_start_pose():
    plan = trajectory([EASTWARD, NORTHWARD, EASTWARD], [False, True, False], directions=[-1, 1, 1])
    assert [(segment.id, first, last) for segment, first, last in sprayed_stretches(plan)] == [("s1", 0.0, 10.0)]
    assert segment_length_m(plan.path.segments[0]) == 10.0
    assert start_pose(plan) == pytest.approx((0.0, 0.0, math.pi))
    with pytest.raises(ValueError, match="no segment"):
        start_pose(trajectory([], []))


def test_every_line_has_its_own_figures():
    ledger = ledger_of(EASTWARD, Curve.from_line((0, 1), (10, 1)), Curve.from_line((0, 2), (10, 2)))
    paint(ledger, line((0, 0.01), (9, 0.01)))
    paint(ledger, line((10, 1), (0, 1)))
    paint(ledger, line((2, 1.03), (8, 1.03)))
    metrics = paint_metrics(ledger)
    first, second, third = metrics.segments
    assert [s.id for s in metrics.segments] == ["s0", "s1", "s2"]
    assert first.gap_m == pytest.approx(1.0)
    assert first.coverage_pct == pytest.approx(90.0)
    assert first.width_m == pytest.approx(0.12)
    assert first.areas.overspray_m2 == pytest.approx(0.09, abs=1e-6)
    assert first.lateral.max_m == pytest.approx(0.01)
    assert second.width_m == pytest.approx(0.12 + 0.6 * 0.03, abs=1e-6)
    assert second.areas.double_paint_m2 == pytest.approx(6 * 0.09, abs=1e-6)
    assert (second.lateral.mean_m, second.lateral.max_m) == pytest.approx((0.03 * 6 / 16, 0.03), abs=1e-4)
    assert (third.coverage_pct, third.width_m, third.areas.painted_m2) == (0.0, 0.0, 0.0)
    assert sum(s.areas.painted_m2 for s in metrics.segments) == pytest.approx(metrics.painted_m2, abs=1e-6)
    assert metrics.gap_m == pytest.approx(sum(s.gap_m for s in metrics.segments))


def test_looking_at_the_coverage_in_between_changes_no_bit():
    rng = np.random.default_rng(3)
    strokes = [
        line(*np.sort(rng.uniform(0, 10, 2))[:, None] * (1, 0) + (0, rng.uniform(-0.05, 0.05))) for _ in range(9)
    ]
    looked, plain = ledger_of(EASTWARD, NORTHWARD), ledger_of(EASTWARD, NORTHWARD)
    for stroke in strokes:
        paint(looked, stroke)
        assert 0.0 < looked.coverage_pct < 100.0
        looked.take_marks()
        paint(plain, stroke)
    assert looked.coverage_pct == plain.coverage_pct
    assert looked.fractions == plain.fractions
    assert looked.covered[0].spans() == plain.covered[0].spans()


def test_a_ledger_takes_more_points_than_it_first_had_room_for():
    ledger = ledger_of(Curve.from_line((0, 0), (60, 0)))
    paint(ledger, line((0, 0), (60, 0)))
    (stroke,) = ledger.strokes()
    assert stroke.points.shape == (6001, 2)
    assert stroke.points[:, 0] == pytest.approx(np.linspace(0, 60, 6001))


@given(
    st.lists(st.one_of(ARC, STRAIGHT), min_size=1, max_size=12),
    st.tuples(st.floats(-60, 60), st.floats(-60, 60)),
    st.floats(-3.2, 3.2),
)
def test_the_grid_holds_every_line_within_reach(curves, point, direction):
    grid = make_grid(curves, REACH_M)
    x, y = curves[0].at(0.5 * curves[0].length_m)[:2] if direction > 0 else point
    x, y = float(x) + 0.4 * math.cos(direction), float(y) + 0.4 * math.sin(direction)
    cell = cell_of(x, y, grid.frame)
    near = set() if cell < 0 else set(grid.members[grid.starts[cell] : grid.starts[cell + 1]].tolist())
    for index, curve in enumerate(curves):
        row = np.array([curve.x_m, curve.y_m, curve.heading_rad, curve.curvature_1pm, curve.length_m])
        s, lateral = project(x, y, row)
        if abs(lateral) <= REACH_M and -REACH_M <= s <= curve.length_m + REACH_M:
            # The straight continuation of an arc turns away; what the ledger needs is within the reach of its end.
            on_arc = curve.at(min(max(s, 0.0), curve.length_m))
            if math.hypot(x - float(on_arc[0]), y - float(on_arc[1])) <= math.sqrt(2) * REACH_M:
                assert index in near


def test_paint_from_a_clogged_nozzle_is_narrower():
    ledger = ledger_of(EASTWARD)
    rows = np.column_stack((line((0, 0), (10, 0)), np.ones(10001)))
    rows[0, 2] = 0.0
    rows[4001:6005, 2] = 0.5
    for first in range(0, 10000, STEPS):
        ledger.record(rows[first : first + STEPS + 1].copy())
    wide, narrow, wide_again = ledger.strokes()
    assert (wide.width_m, narrow.width_m, wide_again.width_m) == pytest.approx((0.12, 0.06, 0.12))
    assert wide.points[-1] == pytest.approx(narrow.points[0])
    assert narrow.points[-1] == pytest.approx((6.004, 0.0))
    assert [marks.width_m for marks in ledger.all_marks()] == [wide.width_m, narrow.width_m, wide_again.width_m]
    metrics = paint_metrics(ledger)
    assert metrics.painted_m2 == pytest.approx(1.2 - 0.06 * 2.004, abs=1e-6)
    assert metrics.segments[0].width_m == pytest.approx(0.12 - 0.06 * 0.2004, abs=1e-6)
    assert metrics.coverage_pct == pytest.approx(100.0)
