"""Plans to a goal from amid another drive: they begin with what is being driven, and leave it within the limits."""

import math

import numpy as np
import pytest

from tests.with_full import with_full
from touchline.onboard.trajectory.path import poses_along
from touchline.onboard.trajectory.trajectory import load_trajectory
from touchline.schemas.cdr import decode, encode
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import LeavingTrajectory, PlanOptions, PlanRequest, PoseGoal
from touchline.schemas.plugins import POSE_METHODS
from touchline.schemas.vehicles.shipped import SHIPPED
from touchline.services.planner.goal_plan import plan_to_goal
from touchline.services.planner.request import answer

pytestmark = pytest.mark.xdist_group("poses")  # its kernels are compiled in one worker

WAFFLE = SHIPPED["turtlebot3-waffle-pi"].vehicle
FIRST = PoseGoal(x_m=4.0, y_m=1.5, heading_rad=0.8)
KEEP_S = 2.0


def first_drive(vehicle, goal=FIRST):
    return plan_to_goal(goal, vehicle, PlanOptions(start=[0.0, 0.0, 0.0]))


def leave(plan, arc_m, vehicle, keep_s=0.0, options=None, **goal):
    aimed = PoseGoal(**({"x_m": -1.0, "y_m": 3.0, "heading_rad": 2.0} | goal))
    leaving = LeavingTrajectory(trajectory=plan.trajectory, arc_length_m=arc_m, keep_s=keep_s)
    return plan_to_goal(aimed, vehicle, options or PlanOptions(), leaving)


def pose_along(loaded, arc_m):
    row = max(int(np.searchsorted(loaded.path[:, 5], arc_m, side="right")) - 1, 0)
    return poses_along(loaded.path[row : row + 1], np.array([arc_m - loaded.path[row, 5]]))[0]


@pytest.mark.parametrize("vehicle", sorted(SHIPPED))
@pytest.mark.parametrize("share", with_full(0.1, 0.99, full=(0.5, 0.9)))
def test_it_begins_with_what_is_driven_and_ends_at_the_goal(vehicle, share):
    chosen = SHIPPED[vehicle].vehicle
    before = first_drive(chosen)
    arc_m = share * before.report.total_length_m
    after = leave(before, arc_m, chosen)
    old, new = load_trajectory(before.trajectory, chosen), load_trajectory(after.trajectory, chosen)
    kept_m = before.speeds.station_at(before.speeds.time_at(arc_m) + KEEP_S) - arc_m
    for along_m in np.linspace(0.0, 0.999 * kept_m, 20):
        assert pose_along(new, along_m)[:2] == pytest.approx(pose_along(old, arc_m + along_m)[:2], abs=1e-9)
        turned = pose_along(new, along_m)[2] - pose_along(old, arc_m + along_m)[2]
        assert math.remainder(turned, math.tau) == pytest.approx(0.0, abs=1e-9)
        assert new.speed_at(along_m) == pytest.approx(old.speed_at(arc_m + along_m), abs=1e-9)
    assert after.report.position_gap_m < 1e-9
    assert after.report.heading_gap_rad < 1e-9
    end = after.sections[-1].path.end
    assert abs(end.point - (-1.0 + 3.0j)) < 1e-9
    assert abs(math.remainder(end.heading_rad - 2.0, math.tau)) < 1e-9
    ends = {entry.arc_length: entry.velocity.value for entry in after.trajectory.velocity_profile.parameters}
    assert list(ends.values())[-1] == 0.0


@pytest.mark.parametrize("method", POSE_METHODS.names())
def test_every_method_leaves_and_gets_there(method):
    before = first_drive(WAFFLE)
    after = leave(before, 1.0, WAFFLE, method=method)
    load_trajectory(after.trajectory, WAFFLE)
    assert abs(after.sections[-1].path.end.point - (-1.0 + 3.0j)) < 1e-9


def test_where_the_new_way_goes_on_it_does_not_stop():
    before = first_drive(WAFFLE)
    after = leave(before, 1.0, WAFFLE, x_m=5.0, y_m=0.5, heading_rad=0.0)
    assert after.speeds.speed_mps[1:-1].min() > 0.05
    last, first = after.sections[0].path.pieces[-1], after.sections[1].path.pieces[0]
    assert first.curvature_1pm == pytest.approx(last.curvature_1pm, abs=1e-12)
    stopping = leave(before, 1.0, WAFFLE, x_m=5.0, y_m=0.5, heading_rad=0.0, method="cubic")
    assert stopping.speeds.speed_mps[1:-1].min() == 0.0
    assert stopping.speeds.total_time_s > after.speeds.total_time_s


def test_the_limits_hold_at_every_millisecond_of_random_goals():
    rng, drive = np.random.default_rng(5), WAFFLE.drive
    for _ in range(20):
        spots = rng.uniform(-4.0, 4.0, (2, 2))
        headings = rng.uniform(-3.1, 3.1, 2)
        before = first_drive(WAFFLE, PoseGoal(x_m=spots[0, 0], y_m=spots[0, 1], heading_rad=headings[0]))
        arc_m = rng.uniform(0.05, 0.95) * before.report.total_length_m
        after = leave(before, arc_m, WAFFLE, x_m=spots[1, 0], y_m=spots[1, 1], heading_rad=headings[1])
        station = np.linspace(0.0, after.report.total_length_m, 20_000)
        speed = after.speeds.speed_at(station)
        ends = np.array([each.end_m for each in after.sent])
        curvature = np.array([each.curve.curvature_1pm for each in after.sent])
        turning = speed * np.abs(curvature[np.minimum(np.searchsorted(ends, station), len(ends) - 1)])
        assert (speed + drive.half_track_m * turning).max() <= drive.max_speed_mps * (1.0 + 1e-6)
        assert turning.max() <= drive.max_yaw_rate_radps * (1.0 + 1e-6)
        gained = np.diff(np.square(after.speeds.speed_mps)) / (2.0 * np.diff(after.speeds.station_m))
        assert np.abs(gained).max() <= drive.max_acceleration_mps2 * (1.0 + 1e-3), (
            "over what is sent, whose length differs a little"
        )


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"arc_m": 99.0}, r"leaving\.arc_length_m = 99, .*; give the arc length at which the robot is"),
        ({"arc_m": -1.0}, r"leaving\.arc_length_m = -1"),
        ({"arc_m": math.nan}, r"leaving\.arc_length_m = nan"),
        ({"keep_s": -1.0}, r"leaving\.keep_s = -1; give seconds"),
        (
            {"options": PlanOptions(start=[0.0, 0.0, 0.0])},
            r"a start and a drive to leave; give options\.start or leaving",
        ),
    ],
)
def test_what_cannot_be_is_refused_with_field_and_remedy(change, says):
    before = first_drive(WAFFLE)
    with pytest.raises(PlanningError, match=says):
        leave(before, **({"arc_m": 1.0, "vehicle": WAFFLE} | change))


def test_over_the_wire_it_needs_a_goal():
    leaving = LeavingTrajectory(trajectory=first_drive(WAFFLE).trajectory, arc_length_m=1.0)
    request = PlanRequest(leaving=(leaving,), goal=(FIRST.model_copy(update={"x_m": 6.0}),))
    assert decode(PlanRequest, encode(request)) == request
    assert answer(request, WAFFLE).success
    assert "no goal" in answer(request.model_copy(update={"goal": ()}), WAFFLE).message
    empty = request.model_copy(update={"leaving": (LeavingTrajectory(),)})
    assert "leaving" in answer(empty, WAFFLE).message


def test_at_the_end_of_a_drive_it_can_be_left_for_a_turn_on_the_spot_there():
    before = first_drive(WAFFLE)
    turned = {"x_m": FIRST.x_m, "y_m": FIRST.y_m, "heading_rad": FIRST.heading_rad + 1.2}
    after = leave(before, 0.99 * before.report.total_length_m, WAFFLE, **turned)
    assert after.report.position_gap_m < 1e-9
    loaded = load_trajectory(after.trajectory, WAFFLE)
    assert [leg.turn_rad for leg in loaded.legs] == pytest.approx([0.0, 1.2])
