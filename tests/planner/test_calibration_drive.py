"""Calibration drive: its path and rests, and the ground that it needs."""

import math

import pytest

from touchline.schemas.errors import PlanningError
from touchline.schemas.known_ground import KnownGround, KnownObstacle
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.shipped import SHIPPED
from touchline.services.planner.calibration_drive import FIRST_REST_S, REST_S, plan_calibration

ROLLER = SHIPPED["clay-roller"].vehicle


def square(x_m, y_m, half_m):
    return tuple((x_m + a * half_m, y_m + b * half_m) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)))


def test_it_turns_on_the_spot_to_both_sides_between_lines_driven_forward_and_backward():
    drive = plan_calibration(Vehicle(), (3.0, 2.0, math.pi / 2))
    sent = drive.plan.sent
    assert [math.degrees(each.spin_rad) for each in sent if each.spin_rad] == pytest.approx([180, -180, 180, 180, -360])
    assert [each.direction * (each.end_m - each.start_m) for each in sent if each.direction] == [2, -2, 4, -4, 4, -4]
    end = drive.plan.sections[-1].path.end
    assert (end.x_m, end.y_m, end.heading_rad) == pytest.approx((3.0, 6.0, math.pi / 2))
    assert 70.0 < drive.time_s < 95.0


def test_it_rests_before_and_after_each_turn():
    rests = plan_calibration(Vehicle()).rests
    assert [rest.at_m for rest in rests] == pytest.approx([0, 1.99, 2, 3.99, 4, 8, 11.99, 12, 15.99, 16])
    assert [rest.time_s for rest in rests] == [FIRST_REST_S, *[REST_S] * 9]


@pytest.mark.parametrize("reverse", [True, False])
def test_a_vehicle_that_cannot_turn_on_the_spot_drives_loops_to_both_sides(reverse):
    drive = plan_calibration(ROLLER.replace("drive.can_reverse", reverse))
    headings = [section.path.end.heading_rad - section.path.start.heading_rad for section in drive.plan.sections]
    turned = [round(math.degrees(each)) for each in headings if abs(each) > 1e-9]
    assert turned == [360, -360]
    assert not any(each.spin_rad for each in drive.plan.sent)
    assert (min(each.direction for each in drive.plan.sent) < 0) is reverse
    ends = {round(each.end_m, 6) for each in drive.plan.sent}
    assert all(round(rest.at_m, 6) in ends for rest in drive.rests[1:])


def test_it_is_refused_where_its_ground_is_not_free():
    plan_calibration(Vehicle(), ground=KnownGround(boundary=square(4.0, 0.0, 6.0)))
    with pytest.raises(PlanningError, match=r"9.8 m × 2.2 m of free ground.*reaches beyond the boundary"):
        plan_calibration(Vehicle(), ground=KnownGround(boundary=square(0.0, 0.0, 6.0)))
    post = KnownObstacle(id="post", corners=square(8.0, 0.9, 0.1))
    with pytest.raises(PlanningError, match='"post" is in the way'):
        plan_calibration(Vehicle(), ground=KnownGround(obstacles=(post,)))
    aside = KnownObstacle(id="post", corners=square(8.0, 1.3, 0.1))
    plan_calibration(Vehicle(), ground=KnownGround(obstacles=(aside,)))


def test_a_robot_without_a_receiver_is_refused():
    with pytest.raises(PlanningError, match="with a GNSS receiver"):
        plan_calibration(SHIPPED["turtlebot2"].vehicle)
