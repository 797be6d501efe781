"""Parameter services of a robot's ROS 2 node."""

from collections.abc import Callable, Collection, Iterable
from typing import Any, Final

from touchline.bus.counters import Counters
from touchline.bus.ros2 import Ros2Request, Ros2Server, Ros2Session
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import decode, encode
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages.base import Message
from touchline.schemas.topics import Service
from touchline.services.bridge.rmw_zenoh import RosNode
from touchline.services.bridge.robot_parameters import RobotParameters, described, listed, refusal
from touchline.services.bridge.routes import problem_of

#: Most requests handled in one turn.
_LOOKED_AT: Final = 16


class ParameterRoute:
    """Answers parameter requests from the robot's setup; nothing can be set.

    Args:
        counters: Counters of the bus, for invalid requests.
        session: Session among ROS 2 nodes.
        node: ROS 2 node of the robot.
        number: Number of the node's first endpoint here.
        offered: Names of the services that are offered.

    Attributes:
        calls: Requests so far.
    """

    def __init__(
        self, counters: Counters, session: Ros2Session, node: RosNode, number: int, offered: Collection[str]
    ) -> None:
        self._counters = counters
        self._parameters = RobotParameters(counters.reject)
        self._servers: list[tuple[Service[Any, Any], Ros2Server]] = []
        for at, service in enumerate(topics.PARAMETER_SERVICES, number):
            if service.name in offered:
                self._servers.append((service, session.serve(node.service_key(service))))
                session.declare_token(node.server_token(at, service))
        self.calls = 0

    def take_setup(self, payload: bytes) -> None:
        """Keep the robot's setup; it is decoded at the first request."""
        self._parameters.take_setup(payload)

    def turn(self) -> None:
        """Answer the requests that wait."""
        for service, server in self._servers:
            for _ in range(_LOOKED_AT):
                if (request := server.poll()) is None:
                    break
                self.calls += 1
                self._answer(service, request)

    def _answer(self, service: Service[Any, Any], request: Ros2Request) -> None:
        problem = problem_of(request)
        try:
            if not problem:
                request.reply(encode(self._response(decode(service.request, request.payload))))
                return
        except PayloadError as error:
            problem = str(error)
        self._counters.reject(f"ROS 2, {service.name}: {problem}")
        request.fail(problem)

    def _response(self, request: Message) -> Message:
        parameters = self._parameters.known()
        match request:
            case m.ListParametersRequest():
                return m.ListParametersResponse(result=listed(parameters, request))
            case m.GetParametersRequest():
                return m.GetParametersResponse(values=self._of(request.names, lambda _, value: value))
            case m.GetParameterTypesRequest():
                return m.GetParameterTypesResponse(types=self._of(request.names, lambda _, value: value.type))
            case m.DescribeParametersRequest():
                return m.DescribeParametersResponse(descriptors=self._of(request.names, described))
            case m.SetParametersRequest():
                return m.SetParametersResponse(results=tuple(refusal(parameters, each) for each in request.parameters))
            case m.SetParametersAtomicallyRequest():
                refused = [refusal(parameters, each) for each in request.parameters]
                nothing = m.SetParametersResult(successful=True)
                return m.SetParametersAtomicallyResponse(result=refused[0] if refused else nothing)
        raise TypeError(f"{request.ros_type} asks for no parameter")

    def _of(self, names: Iterable[str], convert: Callable[[str, m.ParameterValue], Any]) -> tuple[Any, ...]:
        """Apply a function to each named parameter; return nothing if one is unknown, as rclpy's nodes do."""
        parameters = self._parameters.known()
        if not all(name in parameters for name in names):
            return ()
        return tuple(convert(name, parameters[name]) for name in names)
