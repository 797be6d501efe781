"""One robot's topics for viewers: what nobody looks at is not even subscribed to, but for clock and setup."""

from __future__ import annotations

import time
from typing import Final

import foxglove

from touchline.schemas import topics
from touchline.schemas.replay_run import Belonging, ReplayFollower
from touchline.schemas.topics import Topic
from touchline.services.bridge.channels import topic_path
from touchline.services.bridge.foxglove.viewer_server import ViewerServer
from touchline.services.bridge.gateway import CLOCK_NAME
from touchline.services.bridge.recorder import is_stamped
from touchline.services.bridge.robot_time import RobotTime
from touchline.services.bridge.viewing import Drawn
from touchline.services.bridge.viewing.body_frames import stamp_of
from touchline.services.bridge.viewing.live_viewing import LiveViewing
from touchline.services.bridge.viewing.viewing import SOURCES_OF
from touchline.services.bus import Bus, Inbox, Sample

_LOOK_EVERY_S: Final = 0.5
#: Viewers forget everything when time steps back, and may hear of that after the messages that followed.
_AGAIN_S: Final = 0.5
#: What other topics are drawn with comes before them; the clock tells when they were.
_FIRST: Final = (topics.CLOCK, topics.SETUP, topics.TEMPLATE, topics.PLAN)
_ORDER: Final = (*_FIRST, *(topic for topic in topics.TOPICS if topic not in _FIRST))
_STAMPED: Final = frozenset(topic.name for topic in topics.TOPICS if is_stamped(topic))
_STAMP_END: Final = 12


class ViewerChannels:
    """Passes one robot's messages on to viewers, and what is drawn of them.

    Args:
        bus: Of the robot.
        server: Of the viewers.
        prefix: Before the names of the robot's own frames.
        clock: Whether its clock is told as ``/clock``, too.

    Attributes:
        setup: The robot's last message of that topic, which parameters are told from; None before it.
        messages: How many were passed on.
    """

    def __init__(self, bus: Bus, server: ViewerServer, prefix: str, *, clock: bool) -> None:
        self._bus = bus
        self._viewing = LiveViewing(bus, prefix)
        self._channels: dict[str, foxglove.Channel] = {}
        self._topics: dict[int, Topic] = {}
        for topic in (*topics.TOPICS, *topics.VIEWING):
            channel = server.channel(topic_path(bus.namespace, topic), topic)
            self._channels[topic.name], self._topics[channel.id()] = channel, topic
        self._clock = server.channel(CLOCK_NAME, topics.CLOCK) if clock else None
        self._inboxes: dict[str, Inbox] = {}
        self._watched: frozenset[Topic] = frozenset()
        self._look_s = 0.0
        self._last: dict[str, bytes] = {}
        self._again_s: float | None = None
        self._replay = ReplayFollower()
        self._time = RobotTime()
        self.setup: bytes | None = None
        self.messages = 0

    @property
    def now_ns(self) -> int:
        """The robot's sim time."""
        return self._time.latest_ns

    @property
    def watched(self) -> bool:
        """Whether anybody looks at anything of it."""
        return bool(self._watched)

    @property
    def taken(self) -> list[str]:
        """The topics that are taken from the bus for viewers."""
        return sorted(self._inboxes)

    def turn(self, subscribed: set[int]) -> bool:
        """Pass on what has come; returns whether anything had.

        Args:
            subscribed: Ids of channels, this robot's and others', to which somebody has subscribed just now.
        """
        now_s = time.monotonic()
        ours = subscribed & self._topics.keys()
        if ours or now_s >= self._look_s:
            self._look_s = now_s + _LOOK_EVERY_S
            self._look()
        for number in ours:
            self._tell_last(self._topics[number].name)
        if self._again_s is not None and now_s >= self._again_s:
            self._again_s = None
            for name in list(self._last):
                self._tell_last(name)
        busy = False
        for topic in _ORDER:
            inbox = self._inboxes.get(topic.name)
            for sample in inbox.drain() if inbox is not None else ():
                busy = True
                self._take(sample)
        for drawn in self._viewing.turn():
            self._draw(drawn)
        return busy

    def _look(self) -> None:
        """See what is looked at, and subscribe to what that takes; what was subscribed to for nothing is let go."""
        watched = {topic for topic in self._topics.values() if self._channels[topic.name].has_sinks()}
        if self._clock is not None and self._clock.has_sinks():
            watched.add(topics.CLOCK)
        if watched != self._watched:
            self._watched = frozenset(watched)
            drawn = self._viewing.want(self._watched & set(topics.VIEWING))
            for each in drawn:
                self._draw(each)
        needed = self._viewing.sources | (self._watched - set(topics.VIEWING)) | {topics.CLOCK}
        names = {topic.name for topic in needed}
        for name in self._inboxes.keys() - names:
            del self._inboxes[name]
            self._last.pop(name, None)
        for topic in topics.VIEWING:  # it may change without our hearing of it
            if topic.name in self._last and not names.issuperset(source.name for source in SOURCES_OF[topic]):
                del self._last[topic.name]
        for name in names - self._inboxes.keys():
            self._inboxes[name] = self._bus.inbox([topics.TOPIC_BY_NAME[name]], keep="recent")

    def _take(self, sample: Sample) -> None:
        name, payload = sample.topic.name, sample.payload
        heard = self._replay.hear(sample.publisher)
        if heard is Belonging.VOID:
            return
        before_ns = self._time.latest_ns
        if heard is Belonging.JUMP:
            self._time = RobotTime()
            self._last.clear()
        if name in _STAMPED and len(payload) >= _STAMP_END:
            seconds, nanoseconds = stamp_of(payload)
            self._time.hear(max(seconds * 1_000_000_000 + nanoseconds, 0), sample.topic is topics.CLOCK)
        if self._time.latest_ns < before_ns:
            self._again_s = time.monotonic() + _AGAIN_S
        if sample.topic is topics.SETUP:
            self.setup = payload
        self._tell(sample.topic, payload)
        if sample.topic is topics.CLOCK and self._clock is not None:
            self._clock.log(payload, log_time=self._time.latest_ns)
        for drawn in self._viewing.take(sample):
            self._draw(drawn)

    def _draw(self, drawn: Drawn) -> None:
        self._tell(drawn.topic, drawn.payload)

    def _tell(self, topic: Topic, payload: bytes) -> None:
        if topic.latched:
            self._last[topic.name] = payload
        if topic in self._watched:
            self._channels[topic.name].log(payload, log_time=self._time.latest_ns)
            self.messages += 1

    def _tell_last(self, name: str) -> None:
        """Tell a latched topic's last message again; who knows it already learns nothing new."""
        if name in self._last:
            self._channels[name].log(self._last[name], log_time=self._time.latest_ns)
