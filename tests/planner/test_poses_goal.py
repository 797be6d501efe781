"""Plans to a goal: every vehicle, method and law, within the limits, as messages that robots take."""

import math

import numpy as np
import pytest

from touchline.onboard.trajectory.trajectory import load_trajectory
from touchline.schemas.cdr import decode, encode
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import LinearDirection, PlanOptions, PlanRequest, PoseGoal, WaySearch
from touchline.schemas.plugins import POSE_METHODS, SPEED_LAWS
from touchline.schemas.vehicles.shipped import SHIPPED
from touchline.services.planner.geometry.clothoid import PathPose
from touchline.services.planner.goal_plan import plan_to_goal
from touchline.services.planner.plots.actuator_series import actuator_series
from touchline.services.planner.poses.g2_path import moving_paths
from touchline.services.planner.poses.traveller import Traveller
from touchline.services.planner.request import answer
from touchline.services.planner.steering.method import CurveEnd

pytestmark = pytest.mark.xdist_group("poses")  # its kernels are compiled in one worker

WAFFLE, TURTLEBOT2 = (SHIPPED[name].vehicle for name in ("turtlebot3-waffle-pi", "turtlebot2"))
HERE = PlanOptions(start=[1.0, -2.0, 0.4])
FORWARD = HERE.model_copy(update={"forward_only": True})
MILLISECOND = 1e-3


def to_goal(vehicle, options=HERE, **goal):
    return plan_to_goal(PoseGoal(**({"x_m": 5.0, "y_m": 1.0, "heading_rad": 1.2} | goal)), vehicle, options)


@pytest.mark.parametrize("vehicle", sorted(SHIPPED))
@pytest.mark.parametrize("method", POSE_METHODS.names())
def test_every_vehicle_gets_there_by_every_method_that_it_can_drive(vehicle, method):
    chosen = SHIPPED[vehicle].vehicle
    if method == "turn-line-turn" and not chosen.drive.can_spin:
        with pytest.raises(PlanningError, match=r"drive\.can_spin"):
            to_goal(chosen, method=method)
        return
    planned = to_goal(chosen, method=method)
    report = planned.report
    assert (report.paint_length_m, report.painted_segments) == (0.0, 0)
    assert report.position_gap_m < 1e-9
    assert report.heading_gap_rad < 1e-9
    assert report.max_curvature_1pm <= planned.limits.curvature_max_1pm * (1.0 + 1e-6)
    end = planned.sections[-1].path.end
    assert abs(end.point - (5.0 + 1.0j)) < 1e-9
    if method not in ("dubins-free", "bearing"):
        assert abs(math.remainder(end.heading_rad - 1.2, math.tau)) < 1e-9
    loaded = load_trajectory(planned.trajectory, chosen)
    assert loaded.total_length_m == pytest.approx(report.total_length_m)
    assert len(loaded.turns) == report.spins
    assert all(parameter.actuation.value == 0 for parameter in planned.trajectory.actuation_profile.parameters)


@pytest.mark.parametrize("method", POSE_METHODS.names())
def test_a_heading_that_is_left_out_is_chosen_and_told(method):
    planned = to_goal(TURTLEBOT2, method=method, heading_rad=math.nan)
    end = planned.sections[-1].path.end
    assert any(
        note.startswith(f"heading {math.remainder(end.heading_rad, math.tau):.3f} rad") for note in planned.notes
    )


def at_every_millisecond(planned):
    """Speed (m/s), yaw rate (rad/s) of what is sent, and of the ideal curve, turns on the spot left out."""
    speeds = planned.speeds
    time = np.arange(0.0, speeds.total_time_s, MILLISECOND)
    left = speeds.time_s + speeds.dwell_s
    entry = np.clip(np.searchsorted(left, time, side="right") - 1, 0, len(left) - 2)
    since = np.clip(time - left[entry], 0.0, speeds.time_s[entry + 1] - left[entry])
    gain = np.diff(speeds.speed_mps)[entry] / (speeds.time_s[entry + 1] - left[entry])
    speed = speeds.speed_mps[entry] + gain * since
    station = speeds.station_m[entry] + (speeds.speed_mps[entry] + 0.5 * gain * since) * since
    ends = np.array([each.end_m for each in planned.sent])
    curvature = np.array([each.curve.curvature_1pm for each in planned.sent])
    return speed, speed * curvature[np.minimum(np.searchsorted(ends, station), len(ends) - 1)]


def random_goal(rng):
    return {"x_m": rng.uniform(-5.0, 5.0), "y_m": rng.uniform(-5.0, 5.0), "heading_rad": rng.uniform(-3.1, 3.1)}


@pytest.mark.parametrize("law", SPEED_LAWS.names())
@pytest.mark.parametrize("vehicle", sorted(SHIPPED))
def test_the_limits_hold_at_every_millisecond(vehicle, law):
    rng, chosen = np.random.default_rng(11), SHIPPED[vehicle].vehicle
    for _ in range(4):
        goal = random_goal(rng) | {"method": "cubic", "law": law}
        try:
            planned = to_goal(chosen, **goal)
        except PlanningError as error:
            assert law == "uniform" and "cusps" in str(error)
            continue
        speed, yaw_rate = at_every_millisecond(planned)
        limits = planned.limits
        assert speed.max() <= limits.transit_speed_mps * (1.0 + 1e-6)
        assert np.abs(speed * yaw_rate).max() <= limits.lateral_mps2 * (1.0 + 1e-6)
        if chosen.drive.kind == "differential":
            half_m, most_mps = chosen.drive.half_track_m, chosen.drive.max_speed_mps
            assert np.abs(yaw_rate).max() <= chosen.drive.max_yaw_rate_radps * (1.0 + 1e-6)
            assert (speed + half_m * np.abs(yaw_rate)).max() <= most_mps * (1.0 + 1e-6)
        assert actuator_series(planned, 0.01).violations(chosen) == 0


@pytest.mark.parametrize("law", ["limits", "cubic", "quintic"])
@pytest.mark.parametrize("method", ["cubic", "g2", "turn-line-turn"])
def test_it_takes_the_time_that_is_wanted_and_refuses_less_than_the_least(law, method):
    least_s = to_goal(WAFFLE, method=method, law=law).speeds.total_time_s
    slow = to_goal(WAFFLE, method=method, law=law, duration_s=1.5 * least_s)
    assert slow.speeds.total_time_s == pytest.approx(1.5 * least_s, abs=1e-3)
    assert load_trajectory(slow.trajectory, WAFFLE).total_time_s == pytest.approx(1.5 * least_s, abs=0.01)
    assert to_goal(WAFFLE, method=method, law=law, duration_s=least_s).speeds.total_time_s == pytest.approx(least_s)
    with pytest.raises(PlanningError, match=f"duration_s = 5; give at least {least_s:.2f}"[:-1]):
        to_goal(WAFFLE, method=method, law=law, duration_s=5.0)


def test_a_turn_alone_is_driven_on_the_spot():
    for near_m in (0.0, 4e-4):
        for method in ("g2", "cubic", "turn-line-turn"):
            planned = to_goal(WAFFLE, method=method, x_m=1.0 + near_m, y_m=-2.0, heading_rad=2.0)
            loaded = load_trajectory(planned.trajectory, WAFFLE)
            assert [turn.angle_rad for turn in loaded.turns.values()] == [pytest.approx(1.6)]
            assert loaded.total_length_m < 1e-3, "the straight that tells the heading"
            end = planned.sections[-1].path.end
            assert (end.x_m, end.y_m, end.heading_rad) == pytest.approx((1.0 + near_m, -2.0, 2.0), abs=1e-9)


def test_where_a_turn_on_the_spot_may_not_be_a_loop_leads_there():
    turned = {"x_m": 1.0, "y_m": -2.0, "heading_rad": 2.0}
    roller = SHIPPED["clay-roller"].vehicle
    for vehicle, options, method in ((WAFFLE, HERE, "dubins"), (WAFFLE, FORWARD, "g2"), (roller, HERE, "g2")):
        planned = to_goal(vehicle, options, method=method, **turned)
        loaded = load_trajectory(planned.trajectory, vehicle)
        assert not loaded.turns
        assert loaded.total_length_m > 0.5
        assert planned.sections[-1].path.end.heading_rad % math.tau == pytest.approx(2.0)


@pytest.mark.parametrize("vehicle", [WAFFLE, TURTLEBOT2, SHIPPED["turf-tank-two"].vehicle])
def test_a_turn_on_the_spot_takes_the_robot_as_long_as_planned(vehicle):
    for turn in (0.1, 1.0, 3.0):
        planned = to_goal(vehicle, method="turn-line-turn", x_m=1.0, y_m=-2.0, heading_rad=0.4 + turn)
        loaded = load_trajectory(planned.trajectory, vehicle)
        assert loaded.total_time_s == pytest.approx(planned.speeds.total_time_s, abs=1e-6)


def test_a_turn_on_the_spot_of_next_to_nothing_is_taken_by_the_robot():
    for turn in (1e-5, 1e-4, 1e-3):
        planned = to_goal(WAFFLE, PlanOptions(start=[0.0, 0.0, turn]), x_m=3.0, y_m=0.0, heading_rad=0.0)
        turned = to_goal(WAFFLE, PlanOptions(start=[0.0, 0.0, turn]), x_m=3.0, y_m=0.0, method="turn-line-turn")
        for each in (planned, turned):
            load_trajectory(each.trajectory, WAFFLE)


def test_the_uniform_law_says_how_late_the_start_is():
    planned = to_goal(WAFFLE, FORWARD, method="cubic", law="uniform", duration_s=30.0)
    speed = planned.speeds.speed_mps[0]
    assert speed > 0.0
    assert planned.notes == (f"begins at {speed:.3f} m/s, so a robot at rest is {speed:.2f} s late",)
    with pytest.raises(PlanningError, match=r"uniform speed law.*turns on the spot"):
        to_goal(WAFFLE, method="turn-line-turn", law="uniform")


@pytest.mark.parametrize(
    ("goal", "options", "says"),
    [
        ({"x_m": math.nan}, HERE, "goal.x_m = nan; give metres"),
        ({"y_m": math.inf}, HERE, "goal.y_m = inf; give metres"),
        ({"heading_rad": math.inf}, HERE, "goal.heading_rad = inf; give radians, or NaN"),
        ({}, PlanOptions(), "no start pose; give options.start"),
        ({"x_m": 1.0, "y_m": -2.0, "heading_rad": 0.4}, HERE, "its goal at its start"),
        ({"x_m": 1.0, "y_m": -2.0, "heading_rad": math.nan}, HERE, "its goal at its start"),
        ({"method": "fly"}, HERE, 'unknown pose method "fly"; use one of: g2'),
        ({"law": "murphy"}, HERE, 'unknown speed law "murphy"; use one of: limits'),
        ({"tangents_m": [1.0]}, HERE, "goal.tangents_m .* give the method cubic"),
        ({"duration_s": math.nan}, HERE, "duration_s = nan"),
        ({"duration_s": math.inf}, HERE, "duration_s = inf; give seconds"),
        ({"duration_s": -1.0}, HERE, "duration_s = -1; give at least"),
        ({"method": "turn-line-turn"}, FORWARD, "may not turn on the spot"),
        ({}, HERE.model_copy(update={"kappa_max_1pm": 50.0}), "kappa_max_1pm = 50"),
    ],
)
def test_what_cannot_be_is_refused_with_field_and_remedy(goal, options, says):
    with pytest.raises(PlanningError, match=says):
        to_goal(WAFFLE, options, **goal)


def test_the_extent_of_the_search_goes_along_with_a_request():
    behind = PlanRequest(goal=(PoseGoal(x_m=-1.0, y_m=0.1),), options=PlanOptions(start=[0.0, 0.0, 0.0]))
    forward = behind.model_copy(update={"search": WaySearch(no_reversing=True)})
    assert decode(PlanRequest, encode(forward)) == forward
    planned = [answer(each, WAFFLE) for each in (behind, forward)]
    backward = [
        any(segment.direction.value == LinearDirection.BACKWARD for segment in each.trajectory.path.segments)
        for each in planned
    ]
    assert backward == [True, False]


def test_a_request_with_a_goal_is_answered_over_the_wire():
    request = PlanRequest(
        goal=(PoseGoal(x_m=3.0, y_m=2.0, heading_rad=1.2, method="cubic", duration_s=30.0),),
        options=PlanOptions(start=[0.0, 0.0, 0.0]),
        vehicle_json=WAFFLE.model_dump_json(),
    )
    assert decode(PlanRequest, encode(request)) == request
    response = answer(request, SHIPPED["turf-tank-two"].vehicle)
    assert response.success
    assert response.message == "to the goal: 3.64 m, 30.00 s"
    assert response.report.total_time_s == pytest.approx(30.0, abs=0.01)
    goal = request.goal[0].model_copy(update={"duration_s": 5.0})
    refused = answer(request.model_copy(update={"goal": (goal,)}), WAFFLE)
    assert not refused.success
    assert "give at least" in refused.message
    both = answer(request.model_copy(update={"template_json": "{}"}), WAFFLE)
    assert "has a goal and a template" in both.message


def test_a_robot_whose_wheels_are_at_their_limit_is_offered_no_way_by_a_turn_of_kilometres():
    traveller = Traveller.of(WAFFLE, PlanOptions())
    at_full_speed = CurveEnd(PathPose(0.0, 0.0, 0.0), 0.0, speed_mps=traveller.limits.transit_speed_mps)
    offers = moving_paths(at_full_speed, CurveEnd(PathPose(2.0, 1.0, 1.0), 0.0), traveller)
    assert len(offers) > 1
    assert max(path.length_m for path in offers) < 50.0
