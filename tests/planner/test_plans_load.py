"""The robot's own computer takes every plan: of every method, option and order."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.planner.drawn import drawn
from touchline.onboard.trajectory.trajectory import load_trajectory
from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import plan

VEHICLE = Vehicle()


@pytest.mark.parametrize("degrees", range(0, 360, 60))
@pytest.mark.parametrize("away_m", [0.0, 5.0])
@pytest.mark.parametrize("back", [False, True])
def test_going_back_on_a_line_loads(degrees: int, away_m: float, back: bool) -> None:
    """Two lines on one straight, the second one behind the first: what is left of the angle between is rounding."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    stations = [(0.0, 3.0), (-1.0, -4.0) if back else (-4.0, -1.0)]
    template = drawn(*((away_m + c * a, away_m + s * a, away_m + c * b, away_m + s * b) for a, b in stations))
    load_trajectory(plan(template, VEHICLE, PlanOptions(order="given")).trajectory, VEHICLE)


@st.composite
def rows(draw: st.DrawFn) -> Template:
    """A few lines on a grid, so that many are collinear or parallel, shuffled."""
    angle = draw(st.sampled_from((0.0, 0.3, math.pi / 2, 2.0)))
    c, s = math.cos(angle), math.sin(angle)
    place = st.tuples(st.integers(0, 4), st.integers(0, 3), st.booleans(), st.sampled_from((0.012, 0.5, 2.0)))
    ends = []
    for column, row, turned, length in draw(st.lists(place, min_size=1, max_size=7, unique=True)):
        x, y = 3.0 * column, 1.5 * row
        a, b = (c * x - s * y, s * x + c * y), (c * (x + length) - s * y, s * (x + length) + c * y)
        ends.append((*b, *a) if turned else (*a, *b))
    return drawn(*ends)


@settings(max_examples=15, deadline=None)
@given(
    rows(),
    st.sampled_from(("g2", "ccd", "dubins-padded")),
    st.sampled_from(("optimised", "given")),
    st.booleans(),
    st.booleans(),
)
def test_every_plan_loads(template: Template, method: str, order: str, forward_only: bool, back: bool) -> None:
    options = PlanOptions(method=method, order=order, forward_only=forward_only, return_to_start=back)
    load_trajectory(plan(template, VEHICLE, options).trajectory, VEHICLE)
