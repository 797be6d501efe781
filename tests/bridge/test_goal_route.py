"""Goals from ROS 2: which poses are goals, on which topics, and what becomes of those that are not."""

import math
import time

import pytest
import zenoh

from tests.bridge.test_gateway import bridge, endpoint, gateway, names, robot, ros, session, turn_until  # noqa: F401
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages import GotoResponse, Header, Point, Pose, PoseStamped, Quaternion
from touchline.services.bridge.goal_route import goal_of


def stamped(x=1.0, y=-2.0, heading=0.7, frame="map", turn=None):
    turn = turn or Quaternion(z=math.sin(0.5 * heading), w=math.cos(0.5 * heading))
    return PoseStamped(header=Header(frame_id=frame), pose=Pose(position=Point(x=x, y=y, z=9.0), orientation=turn))


@pytest.mark.parametrize("frame", ["map", ""])
@pytest.mark.parametrize("heading", [-3.1, -1.0, 0.0, 2.0, 3.1, 4.0])
def test_a_pose_in_the_map_is_a_goal(frame, heading):
    goal = goal_of(stamped(heading=heading, frame=frame))
    assert (goal.x_m, goal.y_m) == (1.0, -2.0)
    assert math.remainder(goal.heading_rad - heading, math.tau) == pytest.approx(0.0, abs=1e-12)
    assert abs(goal.heading_rad) <= math.pi


def test_a_quaternion_and_its_opposite_are_one_turn():
    turn = Quaternion(z=-math.sin(0.35), w=-math.cos(0.35))
    assert goal_of(stamped(turn=turn)).heading_rad == pytest.approx(0.7)


@pytest.mark.parametrize(
    ("pose", "says"),
    [
        (stamped(frame="odom"), "header.frame_id is 'odom': give the pose in the frame map"),
        (stamped(x=math.nan), "not finite"),
        (stamped(turn=Quaternion(w=0.0)), "has the length 0: give a unit quaternion"),
        (stamped(turn=Quaternion(z=1.0, w=1.0)), "has the length 1.41"),
        (stamped(turn=Quaternion(x=0.6, w=0.8)), "not level"),
    ],
)
def test_any_other_is_refused_with_field_and_remedy(pose, says):
    with pytest.raises(PayloadError, match=says):
        goal_of(pose)


@pytest.mark.parametrize("name", ["/goal_pose", "/tt2/goal_pose"])
def test_a_goal_gets_to_the_robot_and_what_is_none_is_told(ros, gateway, names, robot, name):  # noqa: F811
    server = robot.serve(topics.GOTO)
    key, waits = names.topic_key(topics.Topic(name, PoseStamped)), zenoh.CongestionControl.BLOCK
    publisher = ros.declare_publisher(key, congestion_control=waits)  # else a megabyte may be dropped
    got = []

    def arrived():
        if (call := server.poll()) is not None:
            got.append(call.request.goal)
            call.reply(GotoResponse(success=True))
        return got

    time.sleep(0.3)  # until the subscription is known
    publisher.put(encode(stamped()))
    turn_until(gateway, arrived)
    assert got[0].heading_rad == pytest.approx(0.7)
    hostile = (
        encode(stamped(frame="odom")),
        b"\0\1\0\0junk",
        b"",
        encode(stamped())[:-9],
        encode(stamped(x=math.inf)),
        bytes(1024 * 1024),
    )
    for payload in hostile:
        publisher.put(payload, attachment=b"of another kind")
        (problem,) = turn_until(gateway, gateway.take_problems)
        assert problem.startswith("the goal from ROS 2 is refused")
    figures = gateway.figures()
    assert figures["ros2_goals"] == 1 + len(hostile)
    assert figures["ros2_goals_refused"] == len(hostile)
    other = names.topic_key(topics.Topic(name, PoseStamped)).rpartition("/")[0] + "/RIHS01_" + 64 * "0"
    ros.put(other, encode(stamped()))
    publisher.put(encode(stamped(x=2.0)))
    turn_until(gateway, lambda: arrived()[1:])
    assert [goal.x_m for goal in got] == [1.0, 2.0]


def test_without_a_robot_that_answers_it_says_so(ros, gateway, names):  # noqa: F811
    publisher = ros.declare_publisher(names.topic_key(topics.Topic("goal_pose", PoseStamped)))
    time.sleep(0.3)
    publisher.put(encode(stamped()))
    (problem,) = turn_until(gateway, gateway.take_problems)
    assert "nobody answers" in problem
