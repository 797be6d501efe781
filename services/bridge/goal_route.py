"""Goals from ROS 2: a pose published there, as RViz does on a click, becomes an order to the robot."""

import math
import uuid
from collections.abc import Sequence
from typing import Final

from touchline.bus import Bus
from touchline.bus.calls import Question
from touchline.bus.ros2 import Ros2Session, Ros2Subscriber
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages import GotoRequest, PoseGoal, PoseStamped
from touchline.services.bridge.rmw_zenoh import RosNode

MAP_FRAMES: Final = ("", "map")
#: Largest deviation of a quaternion's length from 1, and of roll and pitch (half of it, rad) from 0.
NORM_TOLERANCE: Final = 0.01
_LEVEL: Final = 0.05
#: Timeout: the robot waits for the planner and for itself.
_ANSWER_S: Final = 90.0


def goal_of(pose: PoseStamped) -> PoseGoal:
    """Convert a pose to a goal.

    Raises:
        PayloadError: It is in another frame, not finite, or not level.
    """
    frame, at, turn = pose.header.frame_id, pose.pose.position, pose.pose.orientation
    if frame not in MAP_FRAMES:
        raise PayloadError(f"header.frame_id is {frame!r}: give the pose in the frame map")
    quaternion = (turn.x, turn.y, turn.z, turn.w)
    if not all(map(math.isfinite, (at.x, at.y, *quaternion))):
        raise PayloadError("the pose is not finite: give metres and a unit quaternion")
    if abs(math.hypot(*quaternion) - 1.0) > NORM_TOLERANCE:
        raise PayloadError(f"pose.orientation has the length {math.hypot(*quaternion):.3g}: give a unit quaternion")
    if math.hypot(turn.x, turn.y) > _LEVEL:
        raise PayloadError("pose.orientation is not level: turn about z alone, x = y = 0")
    return PoseGoal(x_m=at.x, y_m=at.y, heading_rad=2.0 * math.remainder(math.atan2(turn.z, turn.w), math.pi))


class GoalRoute:
    """Passes goals from topics of ROS 2 to the robot, of several at once the newest.

    The robot reports the outcome of a goal in its event log; failures before that are reported here.

    Args:
        bus: Bus of the robot by which ROS 2 nodes ask.
        session: Session among ROS 2 nodes.
        node: ROS 2 node of the robot.
        number: Number of the node's first endpoint here.
        names: Names of the topics; absolute with a leading slash.

    Attributes:
        goals: Goals that have come.
        refused: Number of invalid ones, of those that were looked at.
        problems: What did not get to the robot, and why; the reader removes them.
    """

    def __init__(self, bus: Bus, session: Ros2Session, node: RosNode, number: int, names: Sequence[str]) -> None:
        self._bus = bus
        self._subscribers: list[Ros2Subscriber] = []
        for at, name in enumerate(names):
            topic = topics.Topic(name, PoseStamped, recorded=False)
            self._subscribers.append(session.subscribe(node.topic_key(topic)))
            session.declare_token(node.subscription_token(number + at, topic))
        self._asked: list[Question] = []
        self.goals = 0
        self.refused = 0
        self.problems: list[str] = []

    def turn(self) -> None:
        """Take new goals, and the robot's answers."""
        for subscriber in self._subscribers:
            payloads = subscriber.take()
            self.goals += len(payloads)
            for payload in payloads[-1:]:
                self._send(payload)
        self._asked = [question for question in self._asked if not self._answered(question)]

    def _send(self, payload: bytes) -> None:
        try:
            goal = goal_of(decode(PoseStamped, payload))
        except PayloadError as error:
            self.refused += 1
            self.problems.append(f"the goal from ROS 2 is refused: {error}")
            return
        request = GotoRequest(request_id=uuid.uuid4().hex, goal=goal)
        self._asked.append(self._bus.ask(topics.GOTO, encode(request), _ANSWER_S))

    def _answered(self, question: Question) -> bool:
        answer = question.poll()
        if answer is not None and answer.payload is None:
            reason = answer.refusal or "nobody answers; is the robot running?"
            self.problems.append(f"the goal from ROS 2 did not get to the robot: {reason}")
        return answer is not None
