"""ROS 2 gateway: every topic and service of the tables, viewers' topics, and goals, for nodes of rmw_zenoh.

Messages and requests pass as bytes, undecoded. A slow or hostile ROS 2 node can hold up nobody on the bus: messages
that it does not take in time are dropped, and its requests are checked by the serving process, like all others.
"""

import threading
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from typing import Final, Self

from touchline.bus import Bus, BusConfig
from touchline.bus.remote_access import is_loopback
from touchline.bus.ros2 import Ros2Endpoint, Ros2Session
from touchline.recordings.viewing import frame_prefix
from touchline.schemas.bus_variables import is_open_to_network
from touchline.schemas.errors import SpecError, TouchlineError
from touchline.schemas.near_names import did_you_mean
from touchline.schemas.roles import Role
from touchline.schemas.topics import (
    CLOCK,
    FOLLOWER_STEP,
    GOTO,
    PARAMETER_SERVICES,
    READ_ONLY_SERVICES,
    SERVICES,
    SETUP,
    TOPICS,
    VIEWING,
)
from touchline.security.identity import Identity
from touchline.services.bridge.door_identity import door_identity
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


_OFFERED: Final = (*SERVICES, *PARAMETER_SERVICES, FOLLOWER_STEP)
#: Those by which ROS 2 nodes change nothing.
_LOOKING: Final = tuple(service.name for service in (*READ_ONLY_SERVICES, *PARAMETER_SERVICES))


@dataclass(frozen=True)
class GatewayConfig:
    """Meeting point, names and permissions of ROS 2 nodes.

    Attributes:
        endpoint: The meeting point.
        domain: ROS domain id.
        namespace: ROS namespace of all names, with or without its leading slash; ``/`` for none, empty for the robot's.
            Of several robots each has its own below that.
        clock: Whether the first robot's sim time is published as ``/clock``.
        topics: Patterns of the names of topics that are published, in the topic table; by default all.
        services: Patterns of the names of services that are offered; by default all on an open bus, and on a secured
            one those that change nothing.
        identity: Name or folder of the identity in whose name ROS 2 nodes ask on a secured bus.
    """

    endpoint: Ros2Endpoint = field(default_factory=Ros2Endpoint)
    domain: int = 0
    namespace: str = ""
    clock: bool = False
    topics: tuple[str, ...] = ()
    services: tuple[str, ...] = ()
    identity: str = ""

    def __post_init__(self) -> None:
        """Refuse an invalid ROS name, and patterns of nothing."""
        _check_patterns("--ros2-topics", self.topics, [topic.name for topic in (*TOPICS, *VIEWING)])
        _check_patterns("--ros2-services", self.services, [service.name for service in _OFFERED])
        parts = self.namespace.strip("/").split("/")
        if self.namespace.strip("/") and not all(part.isidentifier() and part.isascii() for part in parts):
            remedy = "use letters, digits, _ and single /, no digit first"
            raise SpecError("command line", "--ros-namespace", f"is {self.namespace!r}", remedy)

    def of(self, robot: str, *, alone: bool) -> Self:
        """Return the configuration for the robot of this namespace, which is alone or one of several."""
        namespace = self.namespace if alone and self.namespace else f"{self.namespace.strip('/')}/{robot}".strip("/")
        return replace(self, namespace=namespace)

    def checked(self, bus: BusConfig) -> Identity | None:
        """Return the identity in whose name ROS 2 nodes ask; None on an open bus.

        Args:
            bus: Configuration of the bus.

        Raises:
            SpecError: The meeting point is open to the network and that is not allowed, or the identity is missing or
                cannot be used.
        """
        if not is_loopback(self.endpoint.locator) and not is_open_to_network():
            problem = f"is {self.endpoint.locator}, beyond this machine"
            remedy = "give --open-to-network: then every ROS 2 node there sees and commands what is offered to it"
            raise SpecError("command line", self.endpoint.option, problem, remedy)
        identity = door_identity(bus, Role.GATEWAY, self.identity)
        if bus.identity is not None and identity is None:
            remedy = "give --gateway-identity NAME (touchline keys issue gateway NAME), in whose name ROS 2 nodes ask"
            raise SpecError("command line", "--ros2", "is given on a secured bus", remedy)
        return identity

    def shows(self, topic: str) -> bool:
        """Return whether a topic of this name is published."""
        return _is_matched(topic, self.topics or ("*",))

    def offers(self, service: str, *, secured: bool) -> bool:
        """Return whether a service of this name is offered."""
        return _is_matched(service, self.services or (_LOOKING if secured else ("*",)))

    def arguments(self) -> list[str]:
        """Options that pass this to ``touchline bridge``."""
        lists = (("--ros2-topics", self.topics), ("--ros2-services", self.services))
        return [
            *("--ros2", self.endpoint.option, self.endpoint.locator),
            *("--ros-domain", str(self.domain), "--ros-namespace", self.namespace),
            *(["--clock"] if self.clock else []),
            *(part for option, patterns in lists for pattern in patterns for part in (option, pattern)),
            *(["--gateway-identity", self.identity] if self.identity else []),
        ]


def _is_matched(name: str, patterns: Iterable[str]) -> bool:
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def _check_patterns(option: str, patterns: Iterable[str], names: Collection[str]) -> None:
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in names):
            remedy = did_you_mean(pattern, names) or "see `touchline topics` for the names, without the robot's"
            raise SpecError("command line", option, f"is {pattern!r}, which matches nothing", remedy)


class Gateway:
    """Passes messages to ROS 2 and requests from it; call :meth:`turn` often.

    Args:
        bus: An open bus.
        asking: The bus by which ROS 2 nodes ask; that one on an open bus.
        session: An open session among ROS 2 nodes.
        config: Names, clock and permissions.
        robots: Robots of all gateways in this session: one that is alone takes goals without a namespace, too, and of
            several the first one's clock is published.

    Raises:
        TouchlineError: Another gateway shows the same robot there.
    """

    def __init__(
        self, bus: Bus, asking: Bus, session: Ros2Session, config: GatewayConfig, robots: Sequence[str] | None = None
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
        offered = {each.name for each in _OFFERED if config.offers(each.name, secured=bus.config.identity is not None)}
        self._topics = {
            topic.name: TopicRoute(session, self._node, at, topic)
            for at, topic in enumerate(TOPICS, 1)
            if config.shows(topic.name)
        }
        self._services = [
            ServiceRoute(asking, bus.counters, session, self._node, at, service)
            for at, service in enumerate(SERVICES, len(TOPICS) + 1)
            if service.name in offered
        ]
        self._stops = [route for route in self._services if route.urgent]
        self._others = [route for route in self._services if not route.urgent]
        names = {self._node.full_name(GOAL_NAME)} | ({f"/{GOAL_NAME}"} if len(robots) == 1 else set())
        at = 1 + len(TOPICS) + len(SERVICES)
        self._goals = GoalRoute(asking, session, self._node, at, sorted(names) if GOTO.name in offered else ())
        at += _GOAL_NAMES
        prefix = frame_prefix(bus.namespace, robots)
        self._viewing = ViewingRoute(bus, session, self._node, at, prefix, config.shows)
        self._clock: TopicRoute | None = None
        if config.clock and first == 0 and self._node.full_name(CLOCK.name) != CLOCK_NAME:
            self._clock = TopicRoute(session, self._node, at + len(VIEWING), replace(CLOCK, name=CLOCK_NAME))
        at = ENDPOINTS - len(PARAMETER_SERVICES)
        self._parameters = ParameterRoute(bus.counters, session, self._node, at, offered)
        self._follower: FollowerRoute | None = None
        if FOLLOWER_STEP.name in offered:
            self._follower = FollowerRoute(asking, session, self._node, at - 1)
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
            if (route := routes.get(sample.topic.name)) is not None:
                route.send(sample)
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
            return self._follower is not None and self._follower.turn()
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
            "ros2_follower_steps": self._follower.steps if self._follower is not None else 0,
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
