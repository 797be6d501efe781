"""Typed, numbered publishing of one topic."""

import time
import uuid

import zenoh
from zenoh import ext

from touchline.bus import attachment
from touchline.bus.counters import Counters
from touchline.schemas.cdr import encode
from touchline.schemas.messages.base import Message
from touchline.schemas.topics import Topic

_CDR = zenoh.Encoding("application/cdr")


class Publisher:
    """Sends the messages of one topic, each with the next sequence number.

    Attributes:
        sequence: Number of the last message.
        id: Id by which receivers distinguish it from other publishers of the topic.
    """

    def __init__(
        self, session: zenoh.Session, key: str, topic: Topic, counters: Counters, publisher_id: bytes | None = None
    ) -> None:
        """Declare the publisher; use :meth:`touchline.bus.Bus.publisher`."""
        self.topic = topic
        self.sequence = 0
        self._counters = counters
        self._key, self._key_sum = key, attachment.checksum_of_key(key)
        self.id = publisher_id or uuid.uuid4().bytes
        self.declare(session)

    def declare(self, session: zenoh.Session) -> None:
        """Publish by this session from now on."""
        self._put = self._declare(session).put

    def begin_anew(self, session: zenoh.Session, publisher_id: bytes) -> None:
        """Continue as another publisher: the former one's last messages are no longer kept for late joiners."""
        self.id, self.sequence = publisher_id, 0
        if self.topic.latched:
            self.declare(session)

    def _declare(self, session: zenoh.Session) -> zenoh.Publisher | ext.AdvancedPublisher:
        control = zenoh.CongestionControl.BLOCK if self.topic.block else zenoh.CongestionControl.DROP
        # A queue for each: in a router, telemetry that is held up must not hold up what comes by other links.
        priority = zenoh.Priority.DATA if self.topic.recorded else zenoh.Priority.DATA_HIGH
        if not self.topic.latched:
            return session.declare_publisher(self._key, encoding=_CDR, congestion_control=control, priority=priority)
        return ext.declare_advanced_publisher(
            session,
            self._key,
            encoding=_CDR,
            congestion_control=control,
            priority=priority,
            cache=ext.CacheConfig(max_samples=1),
            sample_miss_detection=ext.MissDetectionConfig(
                heartbeat=None, sporadic_heartbeat=None
            ),  # numbers the cached samples
            publisher_detection=True,
        )

    def send(self, message: Message) -> None:
        """Publish a message under the next sequence number."""
        if type(message) is not self.topic.type:
            raise TypeError(f"{self.topic.name} carries {self.topic.type.__name__}, not {type(message).__name__}")
        self.send_bytes(encode(message))

    def send_bytes(self, payload: bytes) -> None:
        """Publish a payload that is already CDR of the topic's type."""
        self.send_numbered(payload, self.sequence + 1)

    def send_numbered(self, payload: bytes, sequence: int) -> None:
        """Publish CDR under the caller's sequence number, which must be larger than the last one."""
        self.sequence = sequence
        numbered = attachment.pack(sequence, time.time_ns(), self.id)
        self._put(payload, attachment=attachment.seal(numbered, self._key_sum, payload))
        self._counters.published += 1
