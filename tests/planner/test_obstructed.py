"""Lines that something is in the way of: what can be reached is planned, the rest is named."""

import math
from collections import defaultdict
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import shapely

from tests.planner.drawn import box, drawn, lines
from tests.planner.test_inside import VEHICLE, bodies_at, check_clear
from touchline.schemas.curves import Curve
from touchline.schemas.errors import NothingReachedError, PlanningError
from touchline.schemas.messages import PlanOptions, PlanRequest
from touchline.schemas.plan_cause import PlanCause
from touchline.schemas.swath_ids import line_id_of
from touchline.schemas.template import ArcSpec, Area, LineSpec, Template, TemplateSegment
from touchline.schemas.vehicles import LidarSpec, Vehicle
from touchline.services.planner.collision.clear_lines import ReachableLines, reachable_lines
from touchline.services.planner.limits import Limits
from touchline.services.planner.plan import Plan, plan
from touchline.services.planner.request import answer
from touchline.services.robot_sim.paint.targets import targets

GIVEN = PlanOptions(order="given")
POST_M = 0.12
POST = box((9.94, -0.06), (10.06, 0.06), "post")


def lengths(planned: Plan) -> dict[str, float]:
    """Painted metres by the line's id."""
    found: dict[str, float] = defaultdict(float)
    for section in planned.sections:
        if section.stroke:
            found[line_id_of(section.stroke.id) or section.stroke.id] += section.stroke.nozzle.length_m
    return dict(found)


def check_parts(template: Template, options: PlanOptions | None = None) -> Plan:
    """The body keeps off everything, and what is painted and what is left out make up the lines."""
    planned = plan(template, VEHICLE, options, enough=lambda: True)
    check_clear(planned, template)
    painted = lengths(planned)
    for segment in template.segments:
        left_m = sum(each.length_m for each in planned.report.left_out if each.line_id == segment.id)
        assert painted.get(segment.id, 0.0) + left_m == pytest.approx(segment.curve().length_m)
        for each in planned.report.left_out:
            if each.line_id == segment.id:
                x, y, _, _ = segment.curve().at(np.array([each.from_m, each.to_m]))
                places = [each.from_x_m, each.to_x_m, each.from_y_m, each.to_y_m]
                assert places == pytest.approx([*x.tolist(), *y.tolist()])
    return planned


def test_a_post_that_a_line_can_be_painted_past_in_one_direction_costs_nothing() -> None:
    beside = box((3.9, 0.2), (4.1, 0.6), "post")
    template = drawn((0, 0, 8, 0), obstacles=(beside,))
    assert check_parts(template).report.left_out == ()


@pytest.mark.full
def test_a_wall_across_several_lines_parts_each() -> None:
    wall = box((5.0, -0.5), (5.3, 4.5), "wall")
    template = drawn((0, 0, 10, 0), (0, 2, 10, 2), (0, 4, 10, 4), obstacles=(wall,))
    report = check_parts(template).report
    assert [(each.line_id, each.outline) for each in report.left_out] == [(f"s{k}", "wall") for k in range(3)]


def test_an_obstacle_that_swallows_a_line_leaves_the_others() -> None:
    bench = box((29.0, -1.0), (35.0, 1.0), "bench")
    template = drawn((0, 0, 8, 0), (30, 0, 34, 0), obstacles=(bench,))
    report = check_parts(template).report
    (left,) = report.left_out
    assert (left.line_id, left.from_m, left.to_m) == ("s1", 0.0, 4.0)


def test_an_arc_is_parted() -> None:
    bow = TemplateSegment(id="bow", arc=ArcSpec(start=(9.0, 0.0), center=(0.0, 0.0), sweep_angle=1.5 * math.pi))
    tree = box((-6.56, 6.16), (-6.16, 6.56), "tree")
    (left,) = check_parts(Template(name="bow", segments=(bow,), obstacles=(tree,))).report.left_out
    assert left.outline == "tree" and left.from_m < 6.75 * math.pi < left.to_m < 13.5 * math.pi


def test_where_nothing_is_left_the_plan_is_refused() -> None:
    bench = box((-2.0, -2.0), (10.0, 2.0), "bench")
    template = drawn((0, 0, 8, 0), (0, 1, 8, 1), obstacles=(bench,))
    with pytest.raises(NothingReachedError, match=r'has no line that can be painted: .* touch "bench"; move the lines'):
        plan(template, VEHICLE)
    assert answer(PlanRequest(template_json=template.to_json()), VEHICLE).nothing_reached


def test_the_refusal_can_be_asked_for() -> None:
    template = drawn((0, 0, 20, 0), obstacles=(POST,))
    with pytest.raises(PlanningError, match=r'segment "s0" cannot be painted: .* would touch "post"'):
        plan(template, VEHICLE, PlanOptions(obstructed="refuse"))
    with pytest.raises(PlanningError, match=r'unknown treatment "ignore".*use leave-out or refuse'):
        plan(template, VEHICLE, PlanOptions(obstructed="ignore"))


@pytest.mark.full
def test_swaths_of_an_area_are_parted_too() -> None:
    area = Area(id="lawn", outline=((0.0, 0.0), (8.0, 0.0), (8.0, 0.3), (0.0, 0.3)))
    post = box((3.95, 0.1), (4.05, 0.2), "post")
    template = Template(name="lawn", areas=(area,), obstacles=(post,))
    planned = plan(template, VEHICLE, GIVEN, enough=lambda: True)
    check_clear(planned, template)
    assert {each.line_id.split("#")[0] for each in planned.report.left_out} == {"lawn"}


def test_round_a_post_both_ends_are_painted_and_the_robot_s_figures_are_of_what_could_be_reached() -> None:
    bench = box((29.0, -1.0), (35.0, 1.0), "bench")
    template = drawn((0, 0, 20, 0), (30, 0, 34, 0), obstacles=(POST, bench))
    planned = check_parts(template, GIVEN)
    left = planned.report.left_out[0]
    assert left.outline == "post" and 0.1 < left.length_m < 3.0 and left.from_m < 10.0 < left.to_m
    assert f'of "s0" from ({left.from_x_m:.2f}, 0.00)' in left.words
    cause = PlanCause.of(GIVEN, planned.report)
    assert cause.left_out == ("s0", "s1")
    wanted = targets(planned.trajectory, template, VEHICLE, cause.left_out)
    assert [each.id for each in wanted] == ["s0 (1)", "s0 (2)"]
    assert sum(each.curve.length_m for each in wanted) == pytest.approx(lengths(planned)["s0"])
    assert all(abs(_across_m(each.curve)) < 1e-9 for each in wanted) and template.paints("s0 (2)")
    whole = targets(planned.trajectory, template, VEHICLE)
    assert {"s0", "s1"} <= {each.id for each in whole}, "a plan that tells nothing has forgotten them"


def _across_m(curve: Curve) -> float:
    return curve.end[1] + curve.y_m


@pytest.mark.parametrize(("start", "least_m"), [((0.0, 3.0, 0.0), 0.2), ((9.95, 0.45, 0.0), 0.095)])
def test_a_lidar_s_protection_lets_the_robot_follow_the_plan(start: tuple[float, ...], least_m: float) -> None:
    robot = Vehicle(sensors=(LidarSpec(name="lidar"),))
    beside = box((9.9, -0.3), (10.0, -0.16), "post")
    template, options = drawn((0, 0, 20, 0), obstacles=(beside,)), PlanOptions(start=np.array(start))
    apart_m = [_apart_m(plan(template, each, options), template) for each in (VEHICLE, robot)]
    assert apart_m[0] == pytest.approx(0.0712, abs=0.001) and apart_m[1] > least_m - 0.005
    kept = options.model_copy(update={"margin_m": 0.0})
    assert _apart_m(plan(template, robot, kept), template) == apart_m[0], "its obstacles have their clearance already"


def _apart_m(planned: Plan, template: Template) -> float:
    """Least distance of the body from the obstacles."""
    poses = [
        np.column_stack(each.path.sample(np.arange(0.0, each.path.length_m, 0.01))[:3]) for each in planned.sections
    ]
    things = shapely.union_all([shapely.Polygon(each.corners) for each in template.obstacles])
    return float(shapely.distance(bodies_at(np.concatenate(poses)), things).min())


def test_parts_that_meet_are_shortened_beside_the_obstacle() -> None:
    template = drawn((0, 0, 10, 0), obstacles=(POST,))
    (line,) = template.segments
    parts = ReachableLines((line,), (((0.0, 6.0), (5.995, 8.0)),), (None,), None)
    assert parts.shortened(["s0 (1)", "s0 (2)"], "s0 (2)").spans == (((0.0, 6.0), (5.995, 7.7)),)
    often = replace(parts, shortened_before=3).shortened(["s0 (1)", "s0 (2)"], "s0 (2)").spans
    assert often == (((0.0, pytest.approx(5.7)), (pytest.approx(6.295), 7.7)),)


def test_a_short_line_stays_whole_when_others_are_shortened() -> None:
    mark = TemplateSegment(id="mark", line=LineSpec(start=(0.0, 5.0), end=(0.2, 5.0)))
    template = Template(name="mark", segments=(*lines((0, 0, 20, 0)), mark), obstacles=(POST,))
    cut = reachable_lines(template.segments, template, VEHICLE, Limits.of(VEHICLE, PlanOptions()))
    shortened = cut.shortened(["s0 (1)", "s0 (2)"], "s0 (2)")
    assert [segment.id for segment in shortened.segments] == ["s0 (1)", "s0 (2)", "mark"]
    assert [each.line_id for each in shortened.left_out] == ["s0"]


def test_a_part_is_shortened_by_ever_more() -> None:
    template = drawn((0, 0, 200, 0), obstacles=(box((99.0, -1.0), (101.0, 1.0), "a"),))
    lengths_m = []
    parts = reachable_lines(template.segments, template, VEHICLE, Limits.of(VEHICLE, PlanOptions()))
    while parts.segments:
        lengths_m.append(parts.segments[0].curve().length_m)
        parts = parts.shortened([segment.id for segment in parts.segments], "s0 (1)")
    steps_m = [a - b for a, b in pairwise(lengths_m)]
    assert steps_m[:6] == pytest.approx([0.3] * 6)
    assert steps_m[6:8] == pytest.approx([0.6, 1.2])
    assert len(lengths_m) < 20


def test_beside_a_post_only_braking_room_and_the_reach_of_the_arm_are_lost_on_each_side() -> None:
    (left,) = check_parts(drawn((0, 0, 20, 0), obstacles=(POST,))).report.left_out
    arm_m, braking_m = 0.15, 1.0**2 / (2.0 * 1.0)
    assert left.length_m == pytest.approx(POST_M + 2.0 * (arm_m + braking_m), abs=0.08)


def test_a_line_that_one_direction_paints_here_and_the_other_there_is_painted_whole() -> None:
    """The wide side of the body is its right: things to the right obstruct one direction, to the left the other."""
    right, left = box((3.9, -0.5), (4.1, -0.3), "right"), box((15.9, 0.3), (16.1, 0.5), "left")
    template = drawn((0, 0, 20, 0), obstacles=(right, left))
    assert plan(template, VEHICLE, GIVEN).report.left_out
    both = plan(template, VEHICLE, enough=lambda: True)
    check_clear(both, template)
    assert both.report.left_out == ()
    assert [section.stroke.flipped for section in both.sections if section.stroke] in ([False, True], [True, False])


def test_lines_that_go_on_but_can_only_be_painted_towards_each_other_are_not_joined() -> None:
    right, left = box((3.9, -0.5), (4.1, -0.3), "right"), box((15.9, 0.3), (16.1, 0.5), "left")
    planned = check_parts(drawn((0, 0, 10, 0), (10, 0, 20, 0), obstacles=(right, left)))
    assert planned.report.left_out == ()


def test_a_line_is_shortened_where_there_is_no_room_to_brake_beyond_its_own_end() -> None:
    """As the rest of a line is that ends where the body may just stand."""
    longest_m = max(abs(x) for x, _ in VEHICLE.body.footprint_m) + 0.1
    west, east = (box((x, -1.0), (x + 0.1, 1.0), "wall") for x in (-longest_m - 0.1, 10.0 + longest_m))
    far = box((30.0, 30.0), (31.0, 31.0), "far")
    for obstacles, spans in (((far, east), ((0.0, 9.7),)), ((west, east), ((0.3, 9.7),)), ((far,), ())):
        template = drawn((0, 0, 10, 0), obstacles=obstacles)
        parts = reachable_lines(template.segments, template, VEHICLE, Limits.of(VEHICLE, PlanOptions()))
        assert parts.spans == (((0.0, 10.0),),), "the body touches nothing"
        assert parts.shortened(["s0"], "s0").spans == (spans,)
