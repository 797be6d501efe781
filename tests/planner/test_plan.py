"""Whole plans: the nozzle paints the template and nothing else, limits hold, joints are exact, errors have a place."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.planner.at_once import planned_at_once
from tests.planner.drawn import drawn
from tests.planner.strategies import poses, templates
from tests.with_full import with_full
from touchline.schemas.catalogue import line_templates, load_template
from touchline.schemas.cdr import decode, encode
from touchline.schemas.curves import Curve, PathTable
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import (
    Actuation,
    LinearDirection,
    PathVelocityParameter,
    PlanOptions,
    PlanRequest,
    Segment,
    Trajectory,
    VelocityType,
)
from touchline.schemas.plugins import METHODS
from touchline.schemas.template import LineSpec, Template, TemplateSegment
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.output.measure import extremes
from touchline.services.planner.plan import Plan, plan
from touchline.services.planner.request import answer
from touchline.services.planner.segments import sent_segments
from touchline.services.planner.swaths.swaths import JOINT_OFFSET_M

VEHICLE = Vehicle()
USUAL = ("baseball-infield", "basketball", "soccer-11", "study-square", "tennis")
"""With all that the others are made of; `test_fields_plan` drives every field."""


def table(trajectory: Trajectory) -> PathTable:
    return PathTable.from_curves([travelled(segment) for segment in trajectory.path.segments])


def travelled(segment: Segment) -> Curve:
    """The segment's curve; for a turn on the spot one without length."""
    if segment.direction.value == LinearDirection.NONE:
        point = segment.curve.arc[0].start
        return Curve(point.x, point.y, 0.0, 0.0, 0.0)
    return Curve.from_message(segment.curve)


def check(planned: Plan, template: Template, method: str, *, given: bool = False) -> None:
    trajectory, report = planned.trajectory, planned.report
    path = table(trajectory)
    segments = trajectory.path.segments
    assert report.position_gap_m < 1e-9
    assert report.heading_gap_rad < 1e-9
    assert len({segment.id for segment in segments}) == len(segments)
    assert report.total_length_m == pytest.approx(path.total_length_m)
    assert report.total_length_m == pytest.approx(report.paint_length_m + report.transition_length_m)
    assert report.total_time_s == pytest.approx(report.paint_time_s + report.transition_time_s)
    assert report.max_curvature_1pm <= planned.limits.curvature_max_1pm * (1 + 1e-9)
    assert max(each.max for each in report.actuators) <= VEHICLE.drive.max_wheel_speed_radps * (1 + 1e-9)
    if method != "dubins-padded":
        assert report.max_sharpness_1pm2 <= planned.limits.sharpness_max_1pm2 * (1 + 1e-9)
        assert max(each.max_rate for each in report.actuators) <= VEHICLE.drive.max_wheel_acceleration_radps2
        check_g2(planned)
        check_wheels(planned)

    # One path segment per template segment, with the nozzle on the template from end to end.
    by_id = {segment.id: segment for segment in template.segments}
    painted = [(k, s) for k, s in enumerate(segments) if s.id in by_id]
    ids = [s.id for _, s in painted]
    assert ids == list(by_id) if given else sorted(ids) == sorted(by_id)
    valve = spray_intervals(trajectory)
    wet = [
        (
            opened + VEHICLE.tool.valve_on_delay_s * speed(planned, opened),
            closed + VEHICLE.tool.valve_off_delay_s * speed(planned, closed),
        )
        for opened, closed in valve
    ]
    for k, segment in painted:
        begin, length = path.starts_m[k], path.array[k, 4]
        x, y, heading, _ = Curve.from_message(segment.curve).at(np.linspace(0.0, length, 9))
        nozzle = x - VEHICLE.tool.nozzle_y_m * np.sin(heading) + 1j * (y + VEHICLE.tool.nozzle_y_m * np.cos(heading))
        given_curve = by_id[segment.id].curve()
        u, v, _, _ = given_curve.at(np.linspace(0.0, given_curve.length_m, 9))
        if abs(abs(given_curve.curvature_1pm) * given_curve.length_m - math.tau) < 1e-6:
            # A circle may begin at any of its eight points.
            assert np.abs(nozzle[:, None] - (u + 1j * v)[None, :]).min(axis=1).max() < 1e-6
        else:
            assert min(np.abs(nozzle - (u + 1j * v)).max(), np.abs(nozzle[::-1] - (u + 1j * v)).max()) < 1e-9
        # The valve really opens at the line's start and closes at its end.
        assert any(start <= begin + 1e-6 and end >= begin + length - 1e-6 for start, end in wet)
    assert sum(closed - opened for opened, closed in valve) <= report.paint_length_m + 1e-6

    check_profile(planned)


def check_wheels(planned: Plan) -> None:
    """Both wheels on the ideal curve under the sent profile, wherever they may be fastest or quickened most."""
    pieces = np.array([piece[:3] for section in planned.sections for piece in section.path.pieces])
    ends = np.cumsum(pieces[:, 0])
    ideal_at = np.array([0.0, *(s.ideal_to_m for s in planned.sent)])
    sent_at = np.array([0.0, *(s.end_m for s in planned.sent)])
    entry_at = np.interp(planned.speeds.station_m, sent_at, ideal_at)
    # Between these v² and the curvature are linear along the ideal curve, and so is what a rim gains in speed.
    border = np.unique(np.concatenate((entry_at, ideal_at, ends)))
    border = border[np.diff(border, prepend=-1.0) > 1e-7]
    squares = np.square(planned.speeds.speed_at(np.interp(border, ideal_at, sent_at)))
    inside = np.linspace(0.0, 1.0, 5)
    ideal = border[:-1] + np.outer(inside, np.diff(border))
    square = squares[:-1] + np.outer(inside, np.diff(squares))
    index = np.minimum(np.searchsorted(ends, ideal[2]), len(pieces) - 1)
    curvature = pieces[index, 1] + pieces[index, 2] * (ideal - (ends - pieces[:, 0])[index])
    gain = np.diff(squares) / (2.0 * np.diff(border))
    r, rim_limit = (
        VEHICLE.drive.half_track_m,
        VEHICLE.drive.max_wheel_acceleration_radps2 * VEHICLE.drive.wheel_radius_m,
    )
    for side in (1, -1):
        rim = gain * (1 + side * curvature * r) + side * square * pieces[index, 2] * r
        assert np.abs(rim).max() <= rim_limit * (1 + 1e-6)
        assert (np.sqrt(square) * np.abs(1 + side * curvature * r)).max() <= VEHICLE.drive.max_speed_mps * (1 + 1e-6)
    assert (square * np.abs(curvature)).max() <= VEHICLE.drive.max_lateral_acceleration_mps2 * (1 + 1e-6)


def check_g2(planned: Plan) -> None:
    pieces = [piece for section in planned.sections for piece in section.path.pieces]
    for last, following in pairwise(pieces):
        if following.spin_rad or last.direction != following.direction or not last.length_m:
            continue  # the robot stands
        assert last.curvature_at(last.length_m) == pytest.approx(following.curvature_1pm, abs=1e-9)
    for last, following in pairwise(planned.sections):
        # Where painted segments join, curvature changes evenly about the joint: that leads a little off the line.
        joined = last.stroke and following.stroke
        apart, turn = following.path.start.seen_from(last.path.end)
        assert abs(apart) < (JOINT_OFFSET_M if joined else 1e-9)
        assert abs(math.remainder(turn, math.tau)) < 1e-9


def check_profile(planned: Plan) -> None:
    """Limits of the executed profile, sampled."""
    speeds = planned.speeds
    parameters = without_spins(planned.trajectory)
    assert [p.arc_length for p in parameters] == speeds.station_m.tolist()
    assert np.diff(speeds.station_m).min() > 0.0
    assert speeds.speed_mps[0] == speeds.speed_mps[-1] == 0.0
    assert speeds.speed_mps.max() <= planned.limits.transit_speed_mps + 1e-12
    station = np.linspace(0.0, speeds.station_m[-1], 2000)
    _, _, _, curvature = table(planned.trajectory).at(station)
    rim = speeds.speed_at(station) * (1 + np.abs(curvature) * VEHICLE.drive.half_track_m)
    assert rim.max() <= VEHICLE.drive.max_speed_mps * (1 + 1e-6)
    for line in planned.painted:
        inside = speeds.speed_at(np.linspace(line.start_m, line.end_m, 20))
        assert np.ptp(inside) < 1e-6
        assert inside.max() <= planned.limits.paint_speed_mps + 1e-9


def without_spins(trajectory: Trajectory) -> list[PathVelocityParameter]:
    """The velocity profile without the two entries of every turn on the spot: its rate, and standstill again."""
    entries = list(trajectory.velocity_profile.parameters)
    for k in reversed([k for k, p in enumerate(entries) if p.velocity.type.value == VelocityType.ANGULAR]):
        assert entries[k - 1].velocity.value == entries[k + 1].velocity.value == 0.0
        del entries[k : k + 2]
    return entries


def spray_intervals(trajectory: Trajectory) -> list[tuple[float, float]]:
    intervals, opened = [], None
    stations = [p.arc_length for p in trajectory.actuation_profile.parameters]
    assert stations == sorted(set(stations))
    for parameter in trajectory.actuation_profile.parameters:
        on = bool(parameter.actuation.value & Actuation.VALVE)
        if on and opened is None:
            opened = parameter.arc_length
        elif not on and opened is not None:
            intervals.append((opened, parameter.arc_length))
            opened = None
    assert opened is None
    return intervals


def speed(planned: Plan, station: float) -> float:
    return float(planned.speeds.speed_at(station))


METHOD_NAMES = sorted(METHODS.names())


# What orders are found in a field of more segments, smaller ones show as well.
ORDERED = 30


@pytest.mark.parametrize("name", with_full(*USUAL, full=sorted(set(line_templates()) - set(USUAL))))
def test_line_templates(name: str) -> None:
    template = load_template(name)
    for order in ("given", "optimised") if len(template.segments) <= ORDERED else ("given",):
        planned = planned_at_once(template, PlanOptions(order=order))
        check(planned, template, "g2", given=order == "given")


@pytest.mark.parametrize("method", METHOD_NAMES[:-1])
@pytest.mark.parametrize("name", ["soccer-11", "study-square"])
def test_other_methods(name: str, method: str) -> None:
    template = load_template(name)
    check(planned_at_once(template, PlanOptions(method=method)), template, method)


@given(templates(), st.sampled_from(METHOD_NAMES), st.booleans(), poses, st.sampled_from(["given", "optimised"]))
@settings(max_examples=25)
def test_random_templates(
    template: Template, method: str, with_start: bool, start: tuple[float, float, float], order: str
) -> None:
    options = PlanOptions(method=method, start=list(start) if with_start else [], order=order)
    planned = planned_at_once(template, options)
    check(planned, template, method, given=order == "given")
    if with_start:
        first = planned.sections[0].path.start
        assert tuple(first) == tuple(start)


def test_wheel_figures_agree_with_finite_differences() -> None:
    """The reported peak wheel speed and acceleration against rim speeds differenced in time at 1 mm steps."""
    options = PlanOptions(transit_speed_mps=1.9, forward_only=True)
    planned = plan(load_template("study-square"), VEHICLE, options)
    pieces = np.array([piece for section in planned.sections for piece in section.path.pieces])
    ends = np.cumsum(pieces[:, 0])
    ideal = np.linspace(0.0, ends[-1], 60_000)
    index = np.minimum(np.searchsorted(ends, ideal), len(pieces) - 1)
    curvature = pieces[index, 1] + pieces[index, 2] * (ideal - (ends - pieces[:, 0])[index])
    sent = np.interp(ideal, [0.0, *(s.ideal_to_m for s in planned.sent)], [0.0, *(s.end_m for s in planned.sent)])
    v = planned.speeds.speed_at(sent)
    moving = slice(50, -50)
    time = np.concatenate(([0.0], np.cumsum(2 * np.diff(ideal) / np.maximum(v[1:] + v[:-1], 1e-9))))
    rims = [v * (1 + side * curvature * VEHICLE.drive.half_track_m) / VEHICLE.drive.wheel_radius_m for side in (1, -1)]
    accelerations = [np.abs(np.diff(rim[moving]) / np.diff(time[moving])).max() for rim in rims]
    found = extremes(planned.sections, planned.sent, planned.speeds, VEHICLE, planned.limits.drive).actuators
    right, left = (np.max(rim) for rim in rims)
    assert [each.max for each in found] == pytest.approx([left, right], rel=1e-3)
    assert [each.max_rate for each in found] == pytest.approx(accelerations[::-1], rel=1e-2)
    assert max(each.max for each in found) <= VEHICLE.drive.max_wheel_speed_radps * (1 + 1e-9)


def test_fast_and_tight_is_slowed_to_what_the_wheels_can() -> None:
    options = PlanOptions(kappa_max_1pm=2.0, sigma_max_1pm2=20.0, transit_speed_mps=2.0, paint_speed_mps=1.9)
    template = load_template("soccer-11")
    check(planned_at_once(template, options), template, "g2")


def test_painted_ids_may_look_like_transition_ids() -> None:
    line = LineSpec(start=(0.0, 0.0), end=(1.0, 0.0))
    template = Template(name="sly", segments=(TemplateSegment(id="t0", line=line),))
    ids = [segment.id for segment in plan(template, VEHICLE).trajectory.path.segments]
    assert ids == ["t1", "t0", "t2"]


def test_a_start_on_the_first_line_still_gets_up_to_speed() -> None:
    template = drawn((0.0, 0.0, 1.0, 0.0))
    start = [0.0, -VEHICLE.tool.nozzle_y_m, 0.0]
    check(plan(template, VEHICLE, PlanOptions(start=start)), template, "g2")


@pytest.mark.parametrize("start", [[1.0, 2.0], [math.nan, 0.0, 0.0], [1e9, 0.0, 0.0]])
def test_an_unusable_start_is_refused(start: list[float]) -> None:
    with pytest.raises(PlanningError, match="start pose"):
        plan(load_template("study-square"), VEHICLE, PlanOptions(start=start))


def test_a_plan_that_fits_no_message_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sent_segments, "SENT_MAX", 20)
    with pytest.raises(PlanningError, match="more than 20 lines and arcs; split the template"):
        plan(load_template("study-square"), VEHICLE)


def test_an_unknown_method_is_refused_with_the_known_ones() -> None:
    with pytest.raises(PlanningError, match="use one of: g2, ccd, dubins-padded"):
        plan(load_template("study-square"), VEHICLE, PlanOptions(method="magic"))


def test_plans_are_the_same_every_time_and_survive_the_wire() -> None:
    template = load_template("tennis")
    first, second = (plan(template, VEHICLE).trajectory for _ in range(2))
    assert encode(first) == encode(second)
    assert decode(Trajectory, encode(first)) == first


def test_progress_reaches_the_end_of_every_stage() -> None:
    seen: dict[str, float] = {}
    plan(load_template("study-square"), VEHICLE, progress=lambda stage, fraction: seen.update({stage: fraction}))
    assert list(seen) == ["timing transitions", "order", "cutting into arcs", "speeds", "report"]
    assert set(seen.values()) == {1.0}


@pytest.mark.parametrize("order", ["", "given"])
def test_a_hundred_thousand_segments_are_refused_at_once(order: str) -> None:
    template = drawn((0.0, 0.0, 1.0, 0.0))
    many = template.model_copy(update={"segments": template.segments * 100_000})
    with pytest.raises(PlanningError, match=r"has 100,000 segments, more than .*split the template"):
        plan(many, VEHICLE, PlanOptions(order=order))


def test_too_many_lines_to_order_are_refused_with_the_way_out() -> None:
    many = drawn(*((0.0, 0.1 * i, 1.0, 0.1 * i) for i in range(1501)))
    with pytest.raises(PlanningError, match=r"has 1,501 lines that do not continue each other.*given order"):
        plan(many, VEHICLE)


TIGHT = '{"name": "n", "segments": [{"id": "dot", "arc": {"start": [0.2, 0], "center": [0, 0], "sweep_angle": 6.0}}]}'
NAN = '{"name": "n", "segments": [{"id": "a", "line": {"start": [NaN, 0], "end": [0, 0]}}]}'


@pytest.mark.parametrize(
    ("text", "expected"),
    [(TIGHT, 'segment "dot"'), (NAN, "segments[0].line.start"), ("{", "not JSON"), ("", "not JSON")],
)
def test_bad_requests_are_answered_with_the_place(text: str, expected: str) -> None:
    response = answer(PlanRequest(template_json=text, options=PlanOptions(method="ccd")), VEHICLE)
    assert not response.success
    assert expected in response.message
    assert response.trajectory == Trajectory()


def test_a_good_request_is_answered_with_plan_report_and_what_was_turned_round() -> None:
    text = '{"name": "n", "segments": [{"id": "c", "arc": {"start": [1, 0], "center": [0, 0], "sweep_angle": 1.5}}]}'
    response = answer(PlanRequest(template_json=text, options=PlanOptions(method="ccd", order="given")), VEHICLE)
    assert response.success
    assert "turned round to be drivable: c" in response.message
    assert response.report.planning_time_s > 0.0
    assert response.trajectory.path.segments
