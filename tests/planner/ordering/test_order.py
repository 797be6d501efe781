"""Ordering: every segment once, as good as an exhaustive search where that can be done, the same every time."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.planner.drawn import drawn
from touchline.schemas.catalogue import load_template
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import ArcSpec, LineSpec, Template, TemplateSegment
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.budget import Budget
from touchline.services.planner.plan import plan
from touchline.services.planner.sequencing.costs import NEVER_S
from touchline.services.planner.sequencing.order import Problem, ordered

VEHICLE = Vehicle()


def random_lines(count: int, seed: int) -> Problem:
    """Lines of 2 to 12 m, strewn over a square of 100 m; the cost is the straight distance in metres."""
    rng = np.random.default_rng(seed)
    ends = rng.random((count, 2)) * 100.0
    angle, length = rng.random(count) * 2.0 * np.pi, 2.0 + 10.0 * rng.random(count)
    others = ends + length[:, None] * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    begin, end = np.concatenate((ends, others)), np.concatenate((others, ends))
    cost = np.zeros((2 * count + 1, 2 * count + 1))
    cost[:-1, :-1] = np.linalg.norm(end[:, None] - begin[None], axis=2)
    segment = np.tile(np.arange(count), 2)
    cost[:-1, :-1][segment[:, None] == segment[None, :]] = NEVER_S
    return Problem(cost, segment, (np.arange(2 * count) + count) % (2 * count))


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
    template = drawn(*((20.0 * k, 0.0, 20.0 * k + 5.0, 0.0) for k in range(4)))
    for start, first in (([-10.0, 0.4, 0.0], "s0"), ([80.0, 0.4, math.pi], "s3")):
        planned = plan(template, VEHICLE, PlanOptions(start=start))
        assert planned.painted[0].segment_id == first


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


def test_the_nozzles_side_is_kept_to_as_far_as_it_saves_time() -> None:
    """Round a rectangle clockwise, the robot outside, a corner is a quarter turn; the other way it is a loop."""
    sides = [(0.0, 0.0, 0.0, 20.0), (0.0, 20.0, 30.0, 20.0), (30.0, 20.0, 30.0, 0.0), (30.0, 0.0, 0.0, 0.0)]
    box, backward = drawn(*sides), drawn(*((*side[2:], *side[:2]) for side in reversed(sides)))
    given = PlanOptions(order="given")
    clockwise, against = (plan(each, VEHICLE, given).report.total_time_s for each in (box, backward))
    assert plan(box, VEHICLE).report.total_time_s <= min(clockwise, against) + 1e-6


def test_an_unknown_order_is_refused() -> None:
    with pytest.raises(PlanningError, match="use optimised or given"):
        plan(load_template("study-square"), VEHICLE, PlanOptions(order="random"))
