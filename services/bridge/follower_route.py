"""Path follower that is a ROS 2 node: passes the robot's requests to it, tick by tick, and its answers back."""

from typing import Any, Final, NamedTuple

from touchline.bus import Bus
from touchline.bus.calls import ServedCall, Server
from touchline.bus.ros2 import Ros2Session
from touchline.bus.ros2_client import Ros2Response
from touchline.schemas import topics
from touchline.services.bridge.rmw_zenoh import RosNode, gid

#: Time for which the robot waits for a step.
_ANSWER_S: Final = 1.0


class _Step(NamedTuple):
    """Request that the follower has not answered yet."""

    call: ServedCall[Any, Any]
    response: Ros2Response


class FollowerRoute:
    """Serves ``follower/step`` on the bus for as long as a ROS 2 node serves it there.

    Answers pass undecoded, and the robot checks them. Without such a node a follower on the bus is alone.

    Args:
        bus: Bus of the robot by which ROS 2 nodes serve.
        session: Session among ROS 2 nodes.
        node: ROS 2 node of the robot.
        number: Number of the node's first endpoint here.

    Attributes:
        steps: Requests so far.
    """

    def __init__(self, bus: Bus, session: Ros2Session, node: RosNode, number: int) -> None:
        self._bus = bus
        service = topics.FOLLOWER_STEP
        token = node.client_token(number, service)
        self._client = session.client(node.service_key(service), node.servers(service), gid(token))
        session.declare_token(token)
        self._server: Server[Any, Any] | None = None
        self._under_way: list[_Step] = []
        self.steps = 0

    def turn(self) -> bool:
        """Pass requests and answers on; return whether there are any."""
        served = self._client.served()
        if served and self._server is None:
            self._server = self._bus.serve(topics.FOLLOWER_STEP)
        elif not served and self._server is not None:
            self._server.close()
            self._server = None
        while self._server is not None and (call := self._server.poll_unread()) is not None:
            self.steps += 1
            self._under_way.append(_Step(call, self._client.ask(call.payload, _ANSWER_S)))
        answered = [step for step in self._under_way if step.response.poll()]
        for step in answered:
            if step.response.payload is not None:
                step.call.reply_bytes(step.response.payload)
            else:
                step.call.fail(step.response.problem)
        self._under_way = [step for step in self._under_way if step not in answered]
        return bool(answered or self._under_way)
