"""ROS 2 gateway: every topic and service of the tables, viewers' topics, and goals, for nodes of rmw_zenoh.

Messages and requests pass as bytes, undecoded. A slow or hostile ROS 2 node can hold up nobody on the bus: messages
that it does not take in time are dropped, and its requests are checked by the serving process, like all others.
"""

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Final, Self

from touchline.bus import Bus
from touchline.bus.ros2 import Ros2Endpoint, Ros2Session
from touchline.recordings.viewing import frame_prefix
from touchline.schemas.errors import SpecError, TouchlineError
from touchline.schemas.topics import CLOCK, PARAMETER_SERVICES, SERVICES, SETUP, TOPICS, VIEWING
from touchline.services.bridge.follower_route import FollowerRoute
from touchline.services.bridge.goal_route import GoalRoute
from touchline.services.bridge.parameter_route import ParameterRoute
from touchline.services.bridge.rmw_zenoh import RosNode
from touchline.services.bridge.routes import ServiceRoute, TopicRoute
from touchline.services.bridge.viewing_route import ViewingRoute

NODE_NAME = "touchline"
#: geometry_msgs/PoseStamped, as RViz and others publish it.
GOAL_NAME: Final = "goal_pose"
_GOAL_NAMES: Final = 2
#: Sim time, as nodes with ``use_sim_time`` expect it.
CLOCK_NAME: Final = "/clock"
#: Most liveliness tokens of a gateway: of its node, follower and clock, each topic, service and name of goals.
ENDPOINTS: Final = 3 + len(TOPICS) + len(VIEWING) + len(SERVICES) + len(PARAMETER_SERVICES) + _GOAL_NAMES
_STOPS_EVERY_S: Final = 0.002
#: Period while a follower is asked, and the robot waits.
_STEPS_EVERY_S: Final = 0.0002


@dataclass(frozen=True)
class GatewayConfig:
    """Meeting point and names for ROS 2 nodes.

    Attributes:
        endpoint: The meeting point.
        domain: ROS domain id.
        namespace: ROS namespace of all names, with or without its leading slash; ``/`` for none, empty for the robot's.
            Of several robots each has its own below that.
        clock: Whether the first robot's sim time is published as ``/clock``.
    """

    endpoint: Ros2Endpoint = field(default_factory=Ros2Endpoint)
    domain: int = 0
    namespace: str = ""
    clock: bool = False

    def __post_init__(self) -> None:
        """Refuse an invalid ROS name."""
        parts = self.namespace.strip("/").split("/")
        if self.namespace.strip("/") and not all(part.isidentifier() and part.isascii() for part in parts):
            remedy = "use letters, digits, _ and single /, no digit first"
            raise SpecError("command line", "--ros-namespace", f"is {self.namespace!r}", remedy)

    def of(self, robot: str, *, alone: bool) -> Self:
        """Return the configuration for the robot of this namespace, which is alone or one of several."""
        namespace = self.namespace if alone and self.namespace else f"{self.namespace.strip('/')}/{robot}".strip("/")
        return replace(self, namespace=namespace)

    def arguments(self) -> list[str]:
        """Options that pass this to ``touchline bridge``."""
        return [
            *("--ros2", self.endpoint.option, self.endpoint.locator),
            *("--ros-domain", str(self.domain), "--ros-namespace", self.namespace),
            *(["--clock"] if self.clock else []),
        ]


class Gateway:
    """Passes messages to ROS 2 and requests from it; call :meth:`turn` often.

    Args:
        bus: An open bus.
        session: An open session among ROS 2 nodes.
        config: Names and clock.
        robots: Robots of all gateways in this session: one that is alone takes goals without a namespace, too, and of
            several the first one's clock is published.

    Raises:
        TouchlineError: Another gateway shows the same robot there.
    """

    def __init__(
        self, bus: Bus, session: Ros2Session, config: GatewayConfig, robots: Sequence[str] | None = None
    ) -> None:
        self._bus = bus
        self._config = config
        robots = robots or [bus.namespace]
        namespace = config.namespace or bus.namespace
        first = robots.index(bus.namespace) * ENDPOINTS
        self._node = RosNode(config.domain, f"/{namespace.strip('/')}", NODE_NAME, session.id, first)
        if session.tokens(self._node.twins()):
            raise TouchlineError(
                f"{config.endpoint.option} {config.endpoint.locator}: ROS 2 node {self._node.full_name(NODE_NAME)} is "
                f"there already in domain {config.domain}; choose another --ros-namespace or --ros-domain"
            )
        session.declare_token(self._node.token())
        self._topics = {topic.name: TopicRoute(session, self._node, at, topic) for at, topic in enumerate(TOPICS, 1)}
        self._services = [
            ServiceRoute(bus, session, self._node, at, service) for at, service in enumerate(SERVICES, len(TOPICS) + 1)
        ]
        self._stops = [route for route in self._services if route.urgent]
        self._others = [route for route in self._services if not route.urgent]
        names = {self._node.full_name(GOAL_NAME)} | ({f"/{GOAL_NAME}"} if len(robots) == 1 else set())
        at = 1 + len(TOPICS) + len(SERVICES)
        self._goals = GoalRoute(bus, session, self._node, at, sorted(names))
        at += _GOAL_NAMES
        self._viewing = ViewingRoute(bus, session, self._node, at, frame_prefix(bus.namespace, robots))
        self._clock: TopicRoute | None = None
        if config.clock and first == 0 and self._node.full_name(CLOCK.name) != CLOCK_NAME:
            self._clock = TopicRoute(session, self._node, at + len(VIEWING), replace(CLOCK, name=CLOCK_NAME))
        self._parameters = ParameterRoute(bus.counters, session, self._node, ENDPOINTS - len(PARAMETER_SERVICES))
        self._follower = FollowerRoute(bus, session, self._node, ENDPOINTS - len(PARAMETER_SERVICES) - 1)
        self._inbox = bus.inbox(TOPICS, keep="recent")
        self._failure: Exception | None = None

    def turn(self) -> bool:
        """Forward what has arrived on either side, except urgent requests; return whether anything had.

        Raises errors of `pass_urgent`: better no gateway than one by which nobody can stop the robot.
        """
        if self._failure is not None:
            raise self._failure
        samples = self._inbox.drain()
        routes = self._topics
        for sample in samples:
            routes[sample.topic.name].send(sample)
            if sample.topic is SETUP:
                self._parameters.take_setup(sample.payload)
            elif sample.topic is CLOCK and self._clock is not None:
                self._clock.send(sample)
        self._viewing.turn(samples)
        for service in self._others:
            service.turn()
        self._goals.turn()
        self._parameters.turn()
        return bool(samples)

    def take_problems(self) -> list[str]:
        """Return problems that nobody else reports to the operator."""
        problems, self._goals.problems = self._goals.problems, []
        return problems

    def pass_urgent(self) -> bool:
        """Forward stop requests, and requests to a follower; if that fails, the next `turn` raises the error.

        Returns:
            Whether a follower is being asked.
        """
        try:
            for service in self._stops:
                service.turn()
            return self._follower.turn()
        except Exception as error:  # noqa: BLE001, raised again by `turn`
            self._failure = error
        return False

    def figures(self) -> dict[str, object]:
        """Return counters for the diagnostics."""
        return {
            "ros2": f"{self._config.endpoint.locator}, domain {self._node.domain}, {self._node.full_name(NODE_NAME)}",
            "ros2_messages": sum(route.messages for route in self._topics.values()),
            "ros2_drawn": self._viewing.messages,
            "ros2_dropped": self._inbox.lost,
            "ros2_calls": sum(service.calls for service in self._services),
            "ros2_parameter_calls": self._parameters.calls,
            "ros2_follower_steps": self._follower.steps,
            "ros2_goals": self._goals.goals,
            "ros2_goals_refused": self._goals.refused,
            "ros2_refused": sum(service.refused for service in self._services),
        }


@contextmanager
def passing_urgent(gateways: Sequence[Gateway]) -> Iterator[None]:
    """Forward stops and steps of a follower in a separate thread, since a turn of the main loop may take long."""
    stop = threading.Event()

    def work() -> None:
        pause_s = _STOPS_EVERY_S
        while not stop.wait(pause_s):
            asking = [gateway.pass_urgent() for gateway in gateways]
            pause_s = _STEPS_EVERY_S if any(asking) else _STOPS_EVERY_S

    thread = threading.Thread(target=work, name="ros2-urgent", daemon=True)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()
