"""Nozzle to robot: both directions of travel, arcs that only one of them can drive, arcs that neither can."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.planner.strategies import template_segments
from touchline.schemas.errors import PlanningError
from touchline.schemas.template import ArcSpec, LineSpec, TemplateSegment
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.swaths.offset import Stroke, strokes

TURF_TANK = Vehicle()
K = 0.41124
CURVATURE_MAX = 1.125


def line(start: tuple[float, float], end: tuple[float, float]) -> TemplateSegment:
    return TemplateSegment(id="line", line=LineSpec(start=start, end=end))


def arc(radius: float, sweep: float) -> TemplateSegment:
    return TemplateSegment(id="arc", arc=ArcSpec(start=(radius, 0.0), center=(0.0, 0.0), sweep_angle=sweep))


def one(segment: TemplateSegment, vehicle: Vehicle = TURF_TANK) -> Stroke:
    return strokes((segment,), vehicle, CURVATURE_MAX)[0]


def test_an_arc_too_tight_one_way_is_painted_the_other_way() -> None:
    stroke = one(arc(1.0, 1.0))
    assert stroke.flipped
    assert stroke.robot.curvature_1pm == pytest.approx(-1 / (1.0 + K))
    assert (stroke.nozzle.x_m, stroke.nozzle.y_m) == pytest.approx((math.cos(1.0), math.sin(1.0)))


@pytest.mark.parametrize("radius", [0.2, K, 0.47])
def test_an_arc_too_tight_both_ways_is_named(radius: float) -> None:
    with pytest.raises(PlanningError, match=r'segment "arc".*radius of .* at least 0\.478 m, or a kappa_max') as caught:
        one(arc(radius, 2.0))
    assert caught.value.segment_id == "arc"


def test_repeated_ids_are_refused() -> None:
    segment = line((0, 0), (1, 0))
    with pytest.raises(PlanningError, match='"line" appears twice'):
        strokes((segment, segment), TURF_TANK, CURVATURE_MAX)


@pytest.mark.parametrize("ahead_m", [0.3, -0.3])
def test_a_nozzle_off_the_axle_has_its_own_smallest_radius(ahead_m: float) -> None:
    """The axle turns at 1/1.125 m about a centre from which the nozzle is 0.3 m along and 0.478 m across."""
    vehicle = TURF_TANK.changed(tool={"nozzle_x_m": ahead_m})
    smallest = math.hypot(0.3, 1 / CURVATURE_MAX - K)
    assert abs(one(arc(smallest + 1e-6, -1.0), vehicle).robot.curvature_1pm) <= CURVATURE_MAX
    with pytest.raises(PlanningError, match=r"radius of at least 0\.564 m"):
        one(arc(0.29, 2.0), vehicle)


@given(template_segments(0), st.sampled_from([-K, 0.0, K]), st.sampled_from([-0.4, 0.0, 0.15]))
def test_the_nozzle_of_the_robot_runs_on_the_segment(
    segment: TemplateSegment, nozzle_y_m: float, nozzle_x_m: float
) -> None:
    vehicle = TURF_TANK.changed(tool={"nozzle_x_m": nozzle_x_m, "nozzle_y_m": nozzle_y_m})
    try:
        (stroke,) = strokes((segment,), vehicle, 2.0)
    except PlanningError:
        assert math.hypot(nozzle_x_m, 0.5 + abs(nozzle_y_m)) > abs(1.0 / segment.curve().curvature_1pm)
        return
    share = np.linspace(0.0, 1.0, 11)
    given_curve = segment.curve().reversed() if stroke.flipped else segment.curve()
    x, y, _, _ = given_curve.at(share * given_curve.length_m)
    u, v, heading, _ = stroke.robot.at(share * stroke.robot.length_m)
    cos, sin = np.cos(heading), np.sin(heading)
    off = np.hypot(u + nozzle_x_m * cos - nozzle_y_m * sin - x, v + nozzle_x_m * sin + nozzle_y_m * cos - y)
    assert off.max() < 1e-12 * max(1.0, float(np.abs((x, y)).max()))
