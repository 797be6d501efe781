"""Ordering: every segment once, as good as an exhaustive search where that can be done, the same every time."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.ordering import random_lines
from touchline.schemas.catalogue import load_template
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import ArcSpec, LineSpec, Template, TemplateSegment
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.budget import Budget
from touchline.services.planner.limits import Limits
from touchline.services.planner.marking import transitions_of
from touchline.services.planner.plan import plan
from touchline.services.planner.sequencing.costs import nodes_of, problem
from touchline.services.planner.sequencing.order import Problem, ordered
from touchline.services.planner.swaths.offset import modes
from touchline.services.planner.swaths.swaths import Painting, swaths

VEHICLE = Vehicle()


def exhaustive(asked: Problem) -> float:
    nodes = [np.flatnonzero(asked.segment == k).tolist() for k in range(asked.segments)]
    return min(
        asked.cost_of(np.array(picked))
        for order in itertools.permutations(range(asked.segments))
        for picked in itertools.product(*(nodes[k] for k in order))
    )


@given(st.integers(1, 5), st.integers(0, 10_000))
@settings(max_examples=20)
def test_few_segments_are_ordered_as_well_as_can_be(count: int, seed: int) -> None:
    asked = random_lines(count, seed)
    found = ordered(asked, kicks=300)
    assert sorted(asked.segment[found].tolist()) == list(range(count))
    assert asked.cost_of(found) == pytest.approx(exhaustive(asked))


def test_more_kicks_are_never_worse_and_the_same_every_time() -> None:
    asked = random_lines(60, 2)
    few, many = (asked.cost_of(ordered(asked, kicks=k)) for k in (1, 20_000))
    assert many <= few
    assert ordered(asked, kicks=5000).tolist() == ordered(asked, kicks=5000).tolist()
    # Plain 2-opt and or-opt reached 370.5 on such an instance of the reference, OR-Tools 375.6; this one's best is 452.
    assert many < 455.0


def test_what_is_enough_ends_the_search_with_every_segment_in_it() -> None:
    asked = random_lines(150, 3)
    told: list[float] = []
    found = ordered(asked, Budget(told.append, lambda: len(told) >= 2))
    assert len(told) == 2
    assert sorted(asked.segment[found].tolist()) == list(range(150))


def test_a_start_pose_decides_what_is_painted_first() -> None:
    segments = tuple(
        TemplateSegment(id=f"s{k}", line=LineSpec(start=(20.0 * k, 0.0), end=(20.0 * k + 5.0, 0.0))) for k in range(4)
    )
    template = Template(name="row", segments=segments)
    for start, first in (([-10.0, 0.4, 0.0], "s0"), ([80.0, 0.4, math.pi], "s3")):
        planned = plan(template, VEHICLE, PlanOptions(start=start))
        assert planned.painted[0].segment_id == first


def test_the_estimated_cost_is_the_time_that_is_planned() -> None:
    """What the matrix says of the order, and what the speed profile makes of it, without run-in and run-out."""
    template, options = load_template("soccer-7"), PlanOptions(drying_time_s=1e-3)
    limits = Limits.of(VEHICLE, options)
    painting = Painting.of(VEHICLE, limits, options)
    choices = swaths(modes(template.segments, VEHICLE, limits.curvature_max_1pm, free=True), painting, free=True)
    asked, _ = problem(choices, transitions_of(VEHICLE, options, limits), painting, None)
    nodes, _, _ = nodes_of(choices)
    planned = plan(template, VEHICLE, options)
    lines = [section.stroke for section in planned.sections if section.stroke]
    order = np.array([[node.strokes for node in nodes].index((line,)) for line in lines])
    begun, ended = planned.painted[0].start_m, planned.painted[-1].end_m
    driven = planned.speeds.time_at(ended) - planned.speeds.time_at(begun)
    assert asked.cost_of(order) == pytest.approx(driven, rel=0.01)


def test_ordering_the_pitch_saves_time_and_a_circle_may_begin_anywhere() -> None:
    template = load_template("soccer-11")
    given_order = plan(template, VEHICLE, PlanOptions(order="given")).report
    free = plan(template, VEHICLE).report
    assert free.total_time_s < 0.85 * given_order.total_time_s
    circle = Template(
        name="circle",
        segments=(
            TemplateSegment(id="line", line=LineSpec(start=(-20.0, 0.0), end=(-9.0, 0.0))),
            TemplateSegment(id="circle", arc=ArcSpec(start=(9.0, 0.0), center=(0.0, 0.0), sweep_angle=2 * math.pi)),
        ),
    )
    nearer = plan(circle, VEHICLE).report
    assert nearer.transition_length_m < plan(circle, VEHICLE, PlanOptions(order="given")).report.transition_length_m


def test_a_line_in_parts_is_painted_in_one_go() -> None:
    parts = [LineSpec(start=(2.0 * k, 0.0), end=(2.0 * k + 2.0, 0.0)) for k in (2, 0, 1)]
    segments = tuple(TemplateSegment(id=f"s{k}", line=part) for k, part in enumerate(parts))
    planned = plan(Template(name="parts", segments=segments), VEHICLE)
    assert planned.report.transitions == 0
    assert planned.painted[-1].end_m - planned.painted[0].start_m == pytest.approx(6.0)


def test_a_circle_in_parts_is_painted_in_one_go() -> None:
    quarters = [
        ArcSpec(start=(9.0 * math.cos(a), 9.0 * math.sin(a)), center=(0.0, 0.0), sweep_angle=math.pi / 2)
        for a in (0.0, math.pi, 1.5 * math.pi, 0.5 * math.pi)
    ]
    segments = tuple(TemplateSegment(id=f"s{k}", arc=quarter) for k, quarter in enumerate(quarters))
    planned = plan(Template(name="parts", segments=segments), VEHICLE)
    assert planned.report.transitions == 0
    # The robot is inside of the circle, or outside.
    driven = planned.painted[-1].end_m - planned.painted[0].start_m
    assert abs(driven - math.tau * 9.0) == pytest.approx(math.tau * abs(VEHICLE.tool.nozzle_y_m))


def test_the_nozzles_side_is_kept_to_as_far_as_it_saves_time() -> None:
    """Round a rectangle clockwise, the robot outside, a corner is a quarter turn; the other way it is a loop."""
    corners = [(0.0, 0.0), (0.0, 20.0), (30.0, 20.0), (30.0, 0.0)]
    lines = [LineSpec(start=a, end=b) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)]
    segments = tuple(TemplateSegment(id=f"s{k}", line=line) for k, line in enumerate(lines))
    box = Template(name="box", segments=segments)
    backward = [LineSpec(start=line.end, end=line.start) for line in reversed(lines)]
    segments = tuple(TemplateSegment(id=f"s{k}", line=line) for k, line in enumerate(backward))
    clockwise = plan(box, VEHICLE, PlanOptions(order="given")).report.total_time_s
    against = plan(Template(name="box", segments=segments), VEHICLE, PlanOptions(order="given")).report.total_time_s
    assert plan(box, VEHICLE).report.total_time_s <= min(clockwise, against) + 1e-6


def test_an_unknown_order_is_refused() -> None:
    with pytest.raises(PlanningError, match="use optimised or given"):
        plan(load_template("study-square"), VEHICLE, PlanOptions(order="random"))
