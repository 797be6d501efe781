"""One robot's topics for viewers; except clock and setup, only those that somebody looks at are subscribed to."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Final, Literal

import foxglove

from touchline.bus import Bus, Inbox, Sample
from touchline.recordings.channels import topic_path
from touchline.recordings.recorder import is_stamped
from touchline.recordings.robot_time import RobotTime
from touchline.recordings.viewing import Drawn
from touchline.recordings.viewing.body_frames import stamp_of
from touchline.recordings.viewing.viewing import SOURCES_OF
from touchline.schemas import topics
from touchline.schemas.replay_run import Belonging, ReplayFollower
from touchline.schemas.topics import Topic
from touchline.services.bridge.foxglove.viewer_server import ViewerServer
from touchline.services.bridge.gateway import CLOCK_NAME
from touchline.services.bridge.live_viewing import LiveViewing

_LOOK_EVERY_S: Final = 0.5
#: Period (wall clock) at which arrived messages are passed on, of frames only the latest.
_PASS_EVERY_S: Final = 0.01
_SAMPLE_EVERY_S: Final = 0.02
#: Viewers forget everything when time steps back, and may notice that after the messages that followed.
_AGAIN_S: Final = 0.5
#: Topics that others are drawn with come before them; the clock gives their time.
_FIRST: Final = (topics.CLOCK, topics.SETUP, topics.TEMPLATE, topics.PLAN)
_ORDER: Final = (*_FIRST, *(topic for topic in topics.TOPICS if topic not in _FIRST))
_STAMPED: Final = frozenset(topic.name for topic in topics.TOPICS if is_stamped(topic))
_STAMP_END: Final = 12
Keep = Literal["recent", "latest"]


class ViewerChannels:
    """Passes one robot's messages on to viewers, and what is drawn from them.

    Args:
        bus: Bus of the robot.
        server: Server of the viewers.
        prefix: Prefix of the robot's own frames.
        clock: Whether its clock is published as ``/clock``, too.

    Attributes:
        setup: The robot's last message of that topic, the source of parameters; None before it.
        messages: Messages passed on.
        taken: Topics that are taken from the bus for viewers.
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
        self._sampled: dict[str, Inbox] = {}
        self._watched: frozenset[Topic] = frozenset()
        self._shown: frozenset[str] = frozenset()
        self._look_s = self._pass_s = self._sample_s = 0.0
        self.taken = ""
        self._last: dict[str, bytes] = {}
        self._again_s: float | None = None
        self._replay = ReplayFollower()
        self._time = RobotTime()
        self.setup: bytes | None = None
        self.messages = 0

    @property
    def now_ns(self) -> int:
        """Sim time of the robot."""
        return self._time.latest_ns

    @property
    def watched(self) -> bool:
        """True if anybody looks at any of its topics."""
        return bool(self._watched)

    def turn(self, subscribed: set[int]) -> bool:
        """Pass on what has arrived; return whether anything had.

        Args:
            subscribed: Ids of channels, this robot's and others', with new subscribers.
        """
        now_s = time.monotonic()
        ours = subscribed & self._topics.keys()
        if ours or now_s >= self._look_s:
            self._look_s = now_s + _LOOK_EVERY_S
            self._look()
        for number in ours:
            self._pass_on_last(self._topics[number].name)
        if self._again_s is not None and now_s >= self._again_s:
            self._again_s = None
            for name in list(self._last):
                self._pass_on_last(name)
        if now_s < self._pass_s:
            return False
        self._pass_s = now_s + _PASS_EVERY_S
        due = [*self._inboxes.values()]
        if now_s >= self._sample_s:
            self._sample_s = now_s + _SAMPLE_EVERY_S
            due += self._sampled.values()
        samples = [sample for inbox in due for sample in inbox.drain()]
        for sample in samples:
            self._take(sample)
        for drawn in self._viewing.turn():
            self._draw(drawn)
        return bool(samples)

    def _look(self) -> None:
        """Find what is looked at, and subscribe to its sources; drop unused subscriptions."""
        watched = {topic for topic in self._topics.values() if self._channels[topic.name].has_sinks()}
        if self._clock is not None and self._clock.has_sinks():
            watched.add(topics.CLOCK)
        if watched != self._watched:
            self._watched = frozenset(watched)
            self._shown = frozenset(topic.name for topic in watched)
            drawn = self._viewing.want(self._watched & set(topics.VIEWING))
            for each in drawn:
                self._draw(each)
        needed = self._viewing.sources | (self._watched - set(topics.VIEWING)) | {topics.CLOCK}
        sampled = needed & self._viewing.sampled - self._watched
        self._inboxes = self._subscribed(self._inboxes, needed - sampled, "recent")
        self._sampled = self._subscribed(self._sampled, sampled, "latest")
        names = {topic.name for topic in needed}
        self.taken = ", ".join(sorted(names))
        for topic in (*topics.TOPICS, *topics.VIEWING):  # it may change without our noticing
            if not names.issuperset(source.name for source in SOURCES_OF.get(topic, (topic,))):
                self._last.pop(topic.name, None)

    def _subscribed(self, known: Mapping[str, Inbox], wanted: set[Topic], keep: Keep) -> dict[str, Inbox]:
        """Return inboxes of the wanted topics, in their order; the others are dropped."""
        names = [topic.name for topic in _ORDER if topic in wanted]
        return {name: known.get(name) or self._bus.inbox([topics.TOPIC_BY_NAME[name]], keep=keep) for name in names}

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
        self._pass_on(sample.topic, payload)
        if sample.topic is topics.CLOCK and self._clock is not None:
            self._clock.log(payload, log_time=self._time.latest_ns)
        for drawn in self._viewing.take(sample):
            self._draw(drawn)

    def _draw(self, drawn: Drawn) -> None:
        self._pass_on(drawn.topic, drawn.payload)

    def _pass_on(self, topic: Topic, payload: bytes) -> None:
        if topic.latched:
            self._last[topic.name] = payload
        if topic.name in self._shown:
            self._channels[topic.name].log(payload, log_time=self._time.latest_ns)
            self.messages += 1

    def _pass_on_last(self, name: str) -> None:
        """Send a latched topic's last message again; who has it already learns nothing new."""
        if name in self._last:
            self._channels[name].log(self._last[name], log_time=self._time.latest_ns)
