"""Lines that remain to be painted, and the part that can be reached beside a robot that stands on the field."""

import math

import pytest

from touchline.jobs.shared.unfinished_lines import Standing, left_out, shortened, unfinished
from touchline.onboard.interface import PaintBelief
from touchline.schemas.errors import PlanningError
from touchline.schemas.line_parts import OVERLAP_M
from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import ArcSpec, LineSpec, Polygon, Template, TemplateSegment
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.collision.clear_lines import clear_lines
from touchline.services.planner.limits import Limits
from touchline.services.planner.plan import plan

VEHICLE = Vehicle()
LIMITS = Limits.of(VEHICLE, PlanOptions())
LINE = TemplateSegment(id="line", line=LineSpec(start=(0.0, 0.0), end=(20.0, 0.0)))
BOW = TemplateSegment(id="bow", arc=ArcSpec(start=(0.0, 8.0), center=(0.0, 13.0), sweep_angle=math.pi))
DONE = TemplateSegment(id="done", line=LineSpec(start=(0.0, -6.0), end=(20.0, -6.0)))
TEMPLATE = Template(name="three", segments=(LINE, BOW, DONE))


def test_the_rest_of_a_line_goes_on_where_its_paint_stopped():
    made = plan(TEMPLATE, VEHICLE)
    left = unfinished(made, TEMPLATE, PaintBelief(("done", "bow", "line"), (0.9995, 0.25, 0.0), 0.0))
    rest = {segment.id: segment.curve() for segment in left}
    assert list(rest) == ["line", "bow"] and rest["line"] == LINE.curve()
    whole = next(line.stroke.nozzle for line in made.sent if line.id == "bow")
    assert rest["bow"].length_m == pytest.approx(0.75 * whole.length_m + OVERLAP_M)
    assert rest["bow"].end == pytest.approx(whole.end)


def test_of_a_line_under_an_obstacle_both_ends_are_left():
    post = Polygon(id="post", corners=((9.0, -1.0), (11.0, -1.0), (11.0, 1.0), (9.0, 1.0)))
    parts = clear_lines(TEMPLATE.model_copy(update={"obstacles": (post,)}), VEHICLE, LIMITS)
    assert [part.id for part in parts] == ["line (1)", "line (2)", "bow", "done"]
    curves = [part.curve() for part in parts[:2]]
    ends = sorted(x for curve in curves for x in (curve.x_m, curve.end[0]))
    assert ends[0] == pytest.approx(0.0) and ends[3] == pytest.approx(20.0)
    assert 6.0 < ends[1] < 9.0 and 11.0 < ends[2] < 14.0
    assert parts[2:] == (BOW, DONE)


def test_the_line_that_ends_beside_a_standing_robot_is_shortened_there():
    beside = [Standing("r2", (22.0, 1.0, 0.0))]
    error = PlanningError("bow", "cannot be reached", "make room")
    shorter = shortened(TEMPLATE, error, beside)
    line = shorter.segments[0].curve()
    assert (line.x_m, line.end[0]) == pytest.approx((0.0, 19.0)) and shorter.segments[1:] == TEMPLATE.segments[1:]
    shorter = shortened(shorter, error, [Standing("r2", (-2.0, 0.0, 0.0))])
    line = shorter.segments[0].curve()
    assert (line.x_m, line.end[0]) == pytest.approx((1.0, 19.0)) and shorter.segments[1:] == TEMPLATE.segments[1:]


def test_where_none_ends_beside_one_the_line_that_is_named_is_left_out():
    afar, error = [Standing("r2", (60.0, 0.0, 0.0))], PlanningError("bow", "cannot be reached", "make room")
    assert [segment.id for segment in shortened(TEMPLATE, error, afar).segments] == ["line", "done"]
    assert shortened(TEMPLATE, PlanningError("", "is wrong", "mend it"), afar) is None
    assert shortened(TEMPLATE, error, []) is None, "no robot stands in the way"


def test_the_room_round_a_standing_robot_is_as_wide_as_asked_for():
    import shapely

    outline = Standing("r1", (3.0, 4.0, math.pi / 2.0)).outline(VEHICLE, 0.6)
    body = shapely.affinity.translate(
        shapely.affinity.rotate(shapely.Polygon(VEHICLE.body.footprint_m), 90.0, origin=(0.0, 0.0)), 3.0, 4.0
    )
    assert shapely.Polygon(outline.corners).exterior.distance(body) == pytest.approx(0.6, abs=0.02)


def test_what_was_left_out_is_what_is_missing_and_a_little_more_at_the_joints():
    post = Polygon(id="post", corners=((9.0, -1.0), (11.0, -1.0), (11.0, 1.0), (9.0, 1.0)))
    parts = clear_lines(TEMPLATE.model_copy(update={"obstacles": (post,)}), VEHICLE, LIMITS)
    left = left_out(TEMPLATE, TEMPLATE.model_copy(update={"segments": parts[:3]}))
    assert [segment.id for segment in left] == ["line (left 1)", "done (left 1)"]
    missing_m = 20.0 - sum(part.curve().length_m for part in parts[:2])
    assert left[0].curve().length_m == pytest.approx(missing_m + 2.0 * OVERLAP_M)
    assert left[1].curve() == DONE.curve()
    assert left_out(TEMPLATE, TEMPLATE) == []
