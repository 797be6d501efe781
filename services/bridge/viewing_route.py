"""Viewers' topics for ROS 2 nodes (RViz): made from the robot's messages as they pass, where somebody looks."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import Final

from touchline.bus import Bus, Sample
from touchline.bus.ros2 import Ros2Session
from touchline.recordings.viewing import Drawn
from touchline.recordings.viewing.viewing import WORK
from touchline.schemas import topics
from touchline.services.bridge.live_viewing import LiveViewing
from touchline.services.bridge.rmw_zenoh import RosNode
from touchline.services.bridge.routes import TopicRoute

#: Topics that change all the time, drawn only for subscribers; the others are drawn and kept for late joiners.
_MOVING: Final = (topics.TRANSFORMS, topics.TRUE_TRANSFORMS, *WORK)
_LOOK_EVERY_S: Final = 0.5


class ViewingRoute:
    """Publishes viewers' topics of one robot.

    Args:
        bus: Bus of the robot.
        session: Session among ROS 2 nodes.
        node: ROS 2 node of the robot.
        number: Number of the node's first endpoint here.
        prefix: Prefix of the robot's own frames.
        shows: Whether a topic of a name is published.
    """

    def __init__(
        self,
        bus: Bus,
        session: Ros2Session,
        node: RosNode,
        number: int,
        prefix: str,
        shows: Callable[[str], bool],
    ) -> None:
        self._viewing = LiveViewing(bus, prefix)
        self._routes = {
            topic.name: TopicRoute(session, node, at, topic)
            for at, topic in enumerate(topics.VIEWING, number)
            if shows(topic.name)
        }
        self._watched = {topic: session.watch(node.topic_key(topic)) for topic in _MOVING if shows(topic.name)}
        self._look_s = 0.0

    @property
    def messages(self) -> int:
        """Number of published messages."""
        return sum(route.messages for route in self._routes.values())

    def turn(self, samples: Iterable[Sample]) -> None:
        """Draw what has come."""
        now_s = time.monotonic()
        if now_s >= self._look_s:
            self._look_s = now_s + _LOOK_EVERY_S
            self._send(self._viewing.want([topic for topic, watched in self._watched.items() if watched()]), 0)
        for sample in samples:
            self._send(self._viewing.take(sample), sample.source_time_ns)
        self._send(self._viewing.turn(), 0)

    def _send(self, drawn: Iterable[Drawn], source_time_ns: int) -> None:
        for each in drawn:
            if (route := self._routes.get(each.topic.name)) is not None:
                route.send_bytes(each.payload, source_time_ns)
