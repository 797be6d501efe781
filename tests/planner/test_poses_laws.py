"""Timing laws: their shapes, and how near the profile is to them."""

import math

import numpy as np
import pytest

from touchline.schemas.messages import PlanOptions, PoseGoal
from touchline.schemas.vehicles.shipped import SHIPPED
from touchline.services.planner.geometry.clothoid import PathPose
from touchline.services.planner.goal_plan import plan_to_goal
from touchline.services.planner.poses.cubic_path import curve_of
from touchline.services.planner.poses.kernels.cubic_curve import tangent
from touchline.services.planner.poses.speed_laws import CUBIC, QUINTIC, UNIFORM

pytestmark = pytest.mark.xdist_group("poses")  # its kernels are compiled in one worker

LAWS = {"uniform": UNIFORM, "cubic": CUBIC, "quintic": QUINTIC}
WAFFLE = SHIPPED["turtlebot3-waffle-pi"].vehicle
START, GOAL, TANGENTS = PathPose(0.0, 0.0, 0.3), PathPose(3.0, 1.5, -0.4), (3.0, 4.0)
TAU = np.linspace(0.0, 1.0, 20_001)


@pytest.mark.parametrize(
    ("name", "peak", "at_ends"), [("uniform", 1.0, 1.0), ("cubic", 1.5, 0.0), ("quintic", 1.875, 0.0)]
)
def test_a_law_goes_from_0_to_1_and_its_rate_is_its_derivative(name, peak, at_ends):
    law = LAWS[name]
    assert law.s(np.array([0.0, 1.0])) == pytest.approx([0.0, 1.0], abs=1e-15)
    assert law.rate(TAU).max() == pytest.approx(peak)
    assert law.rate(TAU)[[0, -1]] == pytest.approx([at_ends, at_ends])
    assert np.gradient(law.s(TAU), TAU)[1:-1] == pytest.approx(law.rate(TAU)[1:-1], abs=1e-6)


@pytest.mark.parametrize("name", sorted(LAWS))
@pytest.mark.parametrize("duration_s", [0.0, 40.0])
def test_between_entries_the_squared_speed_is_within_half_a_percent_of_the_law(name, duration_s):
    goal = PoseGoal(
        x_m=GOAL.x_m, y_m=GOAL.y_m, heading_rad=GOAL.heading_rad, method="cubic", tangents_m=TANGENTS, law=name,
        duration_s=duration_s,
    )  # fmt: skip
    planned = plan_to_goal(goal, WAFFLE, PlanOptions(start=START))
    law, total_s = LAWS[name], planned.speeds.total_time_s
    assert duration_s == 0.0 or total_s == pytest.approx(duration_s, abs=0.01)
    curve = curve_of(START, GOAL, TANGENTS)
    speed = np.abs(tangent(curve, law.s(TAU))) * law.rate(TAU) / total_s
    station = np.concatenate(([0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(TAU) * total_s)))
    station *= planned.report.total_length_m / station[-1]
    wanted, found = np.square(speed), np.square(planned.speeds.speed_at(station))
    inside = (TAU > 0.01) & (TAU < 0.99)
    assert np.abs(found / np.where(inside, wanted, np.inf) - inside).max() < 0.005
    assert np.abs(found - wanted).max() < 0.005 * wanted.max()
    assert math.isclose(float(np.interp(0.5 * total_s, planned.speeds.time_s, planned.speeds.station_m)),
                        float(np.interp(0.5, TAU, station)), abs_tol=0.01)  # fmt: skip


@pytest.mark.parametrize("law", ["uniform", "quintic"])
def test_tangents_are_chosen_for_the_law(law):
    """The fastest path within the limits bends sharply at its ends, and takes a law a third longer than need be."""
    asked = {"x_m": 8.0, "y_m": 3.0, "heading_rad": 0.8, "method": "cubic", "law": law}
    options = PlanOptions(start=[0.0, 0.0, 0.0])
    chosen_s = plan_to_goal(PoseGoal(**asked), WAFFLE, options).speeds.total_time_s
    others = (plan_to_goal(PoseGoal(**asked, tangents_m=[k]), WAFFLE, options) for k in (2.0, 5.0, 8.5, 14.0))
    assert chosen_s <= min(other.speeds.total_time_s for other in others)
