"""Segments that go on into one another are painted in one go."""

import math
from dataclasses import replace
from itertools import pairwise
from unittest.mock import patch

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from touchline.schemas.curves import Curve
from touchline.schemas.messages import Actuation, PlanOptions
from touchline.schemas.template import ArcSpec, LineSpec, Template, TemplateSegment
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.limits import Limits
from touchline.services.planner.plan import Plan, plan
from touchline.services.planner.swaths import swaths as planned_swaths
from touchline.services.planner.swaths.offset import modes
from touchline.services.planner.swaths.swaths import JOINT_OFFSET_M, Painting, Swath, swaths

VEHICLE = Vehicle()


def line(name: str, start: tuple[float, float], end: tuple[float, float]) -> TemplateSegment:
    return TemplateSegment(id=name, line=LineSpec(start=start, end=end))


def arc(name: str, start: tuple[float, float], center: tuple[float, float], sweep_deg: float) -> TemplateSegment:
    return TemplateSegment(id=name, arc=ArcSpec(start=start, center=center, sweep_angle=math.radians(sweep_deg)))


def slot() -> list[TemplateSegment]:
    """Two lines and two half circles."""
    return [
        line("south", (0.0, 0.0), (4.0, 0.0)),
        arc("east", (4.0, 0.0), (4.0, 1.0), 180.0),
        line("north", (4.0, 2.0), (0.0, 2.0)),
        arc("west", (0.0, 2.0), (0.0, 1.0), 180.0),
    ]


def segment_of(name: str, curve: Curve) -> TemplateSegment:
    if not curve.curvature_1pm:
        return line(name, (curve.x_m, curve.y_m), curve.end[:2])
    radius = 1.0 / curve.curvature_1pm
    center = curve.x_m - radius * math.sin(curve.heading_rad), curve.y_m + radius * math.cos(curve.heading_rad)
    return arc(name, (curve.x_m, curve.y_m), center, math.degrees(curve.curvature_1pm * curve.length_m))


@st.composite
def chains(draw: st.DrawFn) -> list[TemplateSegment]:
    """Lines and arcs of which each goes on into the next, some of them given the other way round, shuffled."""
    x, y, heading = draw(st.floats(-20, 20)), draw(st.floats(-20, 20)), draw(st.floats(-3.0, 3.0))
    segments = []
    for i in range(draw(st.integers(2, 8))):
        bend, length = draw(st.sampled_from((0.0, 0.02, 0.3, -0.5, 1.2, -1.5))), draw(st.floats(0.05, 3.0))
        curve = Curve(x, y, heading, bend, length)
        x, y, heading = curve.end
        segments.append(segment_of(f"s{i}", curve.reversed() if draw(st.booleans()) else curve))
    return draw(st.permutations(segments))


def template(segments: list[TemplateSegment]) -> Template:
    return Template(name="drawing", segments=tuple(segments))


def found(segments: list[TemplateSegment], *, free: bool = True, **options: object) -> list[list[Swath]]:
    asked = PlanOptions.model_validate(options)
    limits = Limits.of(VEHICLE, asked)
    choices = modes(tuple(segments), VEHICLE, limits.curvature_max_1pm, free=free)
    return swaths(choices, Painting.of(VEHICLE, limits, asked), free=free)


def ids(swath: Swath) -> list[str]:
    return [stroke.id for stroke in swath.strokes]


def sprayed_m(planned: Plan) -> list[tuple[float, float]]:
    """Arc lengths between which the valve is open."""
    switches = [
        (p.arc_length, bool(p.actuation.value & Actuation.VALVE))
        for p in planned.trajectory.actuation_profile.parameters
    ]
    opened = [(s, on) for (s, on), before in zip(switches, [(0.0, False), *switches], strict=False) if on != before[1]]
    return [(a, b) for (a, on), (b, _) in pairwise(opened) if on]


def test_a_closed_outline_is_one_swath_that_may_begin_at_any_of_its_joints_either_way() -> None:
    ((*options,),) = found(slot())
    assert len(options) == 8
    assert {tuple(sorted(ids(option))) for option in options} == {("east", "north", "south", "west")}
    assert {option.strokes[0].id for option in options} == {"east", "north", "south", "west"}


@settings(max_examples=25, deadline=None)
@given(chains())
def test_a_chain_is_found_whichever_way_its_segments_are_given(segments: list[TemplateSegment]) -> None:
    tight = [swath for options in found(segments) for swath in options]
    for swath in tight:
        for before, after in pairwise(swath.strokes):
            apart, turn = after.begin.pose.seen_from(before.end.pose)
            assert abs(apart) < 1e-9
            assert abs(math.remainder(turn, math.tau)) < 1e-9
    painted = [name for options in found(segments) for name in ids(options[0])]
    assert sorted(painted) == sorted(segment.id for segment in segments)
    with patch.object(planned_swaths, "PARTING_S", 1e6):
        assert len(found(segments)) == 1


@settings(max_examples=25, deadline=None)
@given(chains())
def test_the_robots_path_is_continuous_in_curvature_and_near_the_line(segments: list[TemplateSegment]) -> None:
    for swath in (swath for options in found(segments) for swath in options):
        pieces = [piece for path in swath.paths for piece in path.pieces]
        for before, after in pairwise(pieces):
            assert after.curvature_1pm == pytest.approx(before.curvature_end_1pm, abs=1e-9)
        for stroke, path in zip(swath.strokes, swath.paths, strict=True):
            assert path.length_m == pytest.approx(stroke.robot.length_m, abs=1e-9)
        for path, following in pairwise(swath.paths):
            assert abs(path.end.point - following.start.point) <= JOINT_OFFSET_M


def test_the_paint_of_a_chain_is_not_interrupted() -> None:
    planned = plan(template(slot()), VEHICLE)
    assert planned.report.transitions == 0
    assert len(sprayed_m(planned)) == 1
    assert max(each.max_rate for each in planned.report.actuators) <= VEHICLE.drive.max_wheel_acceleration_radps2
    assert planned.report.max_lateral_acceleration_mps2 <= VEHICLE.drive.max_lateral_acceleration_mps2 * (1 + 1e-6)


def test_in_the_given_order_only_what_follows_is_joined() -> None:
    south, east, north, west = slot()
    assert [ids(options[0]) for options in found([south, north, east, west], free=False)] == [
        ["south"],
        ["north"],
        ["east"],
        ["west"],
    ]
    assert [ids(options[0]) for options in found([south, east, north, west], free=False)] == [
        ["south", "east", "north", "west"]
    ]


def test_a_circle_alone_begins_anywhere() -> None:
    ((*options,),) = found([arc("circle", (2.0, 0.0), (0.0, 0.0), 360.0)])
    assert len(options) == 16


def test_a_corner_joins_nothing() -> None:
    assert len(found([line("a", (0, 0), (2, 0)), line("b", (2, 0), (2, 2))])) == 2


def test_different_paint_is_not_joined() -> None:
    south, east, *_ = slot()
    other = east.model_copy(update={"actuation": "SPRAY"})
    assert len(found([south, east])) == 1
    assert len(found([south, other])) == 2


def test_a_joint_that_would_slow_down_a_long_line_parts_it() -> None:
    """A bend of 2 cm at 1.5 1/m between two long lines: its joints are passed so slowly that parting is quicker."""
    begin = Curve(0.0, 0.0, 0.0, 0.0, 40.0)
    bend = Curve(*begin.end, 1.8, 0.02)
    long = Curve(*bend.end, 0.0, 40.0)
    curves = {"a": begin, "b": bend, "c": long}
    parts = found([segment_of(name, curve) for name, curve in curves.items()])
    assert len(parts) > 1
    short = [segment_of(name, replace(curve, length_m=min(curve.length_m, 1.0))) for name, curve in curves.items()]
    near = [short[0], *(segment_of(n, c) for n, c in (("b", Curve(1.0, 0.0, 0.0, 1.8, 0.02)),))]
    assert len(found(near)) == 1


def test_the_asked_sharpness_holds_at_joints_too() -> None:
    assert len(found(slot())) == 1
    assert len(found(slot(), sigma_max_1pm2=1.0)) == 4


def test_the_studys_padding_is_round_every_segment() -> None:
    assert len(found(slot(), method="dubins-padded")) == 4


def test_a_line_too_short_for_the_valve_is_painted_more_slowly() -> None:
    planned = plan(template([line("dot", (0, 0), (0.01, 0)), line("line", (3, 0), (6, 0))]), VEHICLE)
    (dot,) = (each for each in planned.painted if each.segment_id == "dot")
    assert planned.speeds.time_at(dot.end_m) - planned.speeds.time_at(dot.start_m) >= (
        VEHICLE.tool.valve_off_delay_s - VEHICLE.tool.valve_on_delay_s
    )
    assert len(sprayed_m(planned)) == 2


def test_a_long_chain_may_be_painted_in_parts_but_is_not_without_need() -> None:
    """Half circles of 50 m radius, 157 m each: nodes of their own to the order, painted in one go all the same."""
    segments = [
        arc("north", (50, 0), (0, 0), 180.0),
        arc("south", (-50, 0), (0, 0), 180.0),
        line("on", (50, 0), (50, 9)),
    ]
    planned = plan(template(segments[:2]), VEHICLE)
    assert len(found(segments[:2])) == 2
    assert planned.report.transitions == 0
    assert len(sprayed_m(planned)) == 1
