"""Polled subscriptions: messages wait in Zenoh's channels until they are drained."""

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from itertools import repeat
from typing import Literal, NamedTuple, TypeAlias

import zenoh
from zenoh import ext, handlers

from touchline.bus import attachment
from touchline.bus.counters import Counters, SequenceGaps
from touchline.bus.last_sent import LastSent
from touchline.bus.prompt import Overtaken, prompt_key
from touchline.schemas.cdr import decode
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages.base import Message
from touchline.schemas.topics import Topic
from touchline.schemas.wellformed import Wellformed

#: Samples of a topic that a lossless inbox holds before its publishers have to wait.
MOST_WAITING = 65_536
#: Most waiting samples of a topic where the oldest gives way.
_RECENT = 1024
_POLL_S = 0.002
#: Publishers whose last check an inbox remembers.
_PUBLISHERS = 1024
_Subscriber: TypeAlias = (
    "zenoh.Subscriber[handlers.Handler[zenoh.Sample]] | ext.AdvancedSubscriber[handlers.Handler[zenoh.Sample]]"
)


class Sample(NamedTuple):
    """One message as it arrived.

    Attributes:
        topic: Its row of the topic table.
        payload: CDR bytes; empty where the inbox only skims and has not looked into it.
        sequence: The publisher's count from 1; 0 from a foreign publisher that does not count.
        source_time_ns: Time of sending, ns since the epoch; 0 if unknown.
        publisher: The publisher's id; empty if unknown.
        missed: Messages of this publisher that are missing just before this one.
        namespace: Namespace of the robot.
    """

    topic: Topic
    payload: bytes
    sequence: int
    source_time_ns: int
    publisher: bytes
    missed: int = 0
    namespace: str = ""

    def decode(self) -> Message:
        """Decode the message.

        Raises:
            PayloadError: The payload is not one of the topic's type.
        """
        return decode(self.topic.type, self.payload)


class Inbox:
    """Samples of several topics of one robot.

    ``keep="all"`` loses nothing: when the inbox is full, publishers of blocking topics wait. ``keep="latest"`` holds
    one sample per topic and lets newer ones replace it; ``keep="recent"`` holds a thousand, so that only a receiver far
    behind loses any, and publishers never wait.

    Attributes:
        namespace: Namespace of the robot.
        lost: Messages that were published but never came out of this inbox, from gaps in the sequence numbers.
        rejected: By topic name, payloads that did not fit their topic or were damaged on the way, from any sender.
        cut: Topics of which the last `drain` took its most, so that more may wait.
    """

    def __init__(
        self,
        session: zenoh.Session,
        namespace: str,
        topics: Sequence[Topic],
        keep: Literal["all", "recent", "latest"],
        counters: Counters,
    ) -> None:
        """Declare the subscriptions; use :meth:`touchline.bus.Bus.inbox`."""
        self.namespace = namespace
        self._counters = counters
        self._keep = keep
        self._subscribers = [
            (topic, Wellformed(topic.type), SequenceGaps(), self._declare(session, topic)) for topic in topics
        ]
        self._key_sums = {topic.name: attachment.checksum_of_key(self._key(topic)) for topic in topics}
        self._overtaken = {topic.name: Overtaken() for topic in topics if topic.prompt and keep != "all"}
        self._copies = self._declare_copies(session)
        self._next: list[_Subscriber] = []
        self.lost = 0
        self._early: list[Sample] = []
        self.rejected: dict[str, int] = {}
        self.cut: set[str] = set()
        self._every_s = 0.0
        self._looked_s: dict[tuple[str, bytes], float] = {}

    def skim(self, every_s: float) -> None:
        """Look into one sample per publisher and topic in every so many seconds; with 0 into each again.

        The others come out with an empty payload, neither checked nor decoded: they only show that they came.
        """
        self._every_s = every_s
        self._looked_s.clear()

    def declare(self, session: zenoh.Session) -> None:
        """Let samples arrive by this session, too; they wait until :meth:`leave_former`."""
        self._next = [self._declare(session, topic) for topic, *_ in self._subscribers]
        self._copies = self._declare_copies(session)

    def leave_former(self) -> None:
        """Take samples from the last session, once those of the former one are taken."""
        if not self._next:
            return
        self._early = self.drain({topic.name: MOST_WAITING for topic, *_ in self._subscribers})
        for _, _, gaps, _ in self._subscribers:
            gaps.begin_again()
        self._subscribers = [
            (topic, form, gaps, new) for (topic, form, gaps, _), new in zip(self._subscribers, self._next, strict=True)
        ]
        self._next = []

    def _key(self, topic: Topic) -> str:
        return f"{self.namespace}/{topic.name}"

    def _declare(self, session: zenoh.Session, topic: Topic) -> "_Subscriber":
        key = self._key(topic)
        channel: handlers.FifoChannel[zenoh.Sample] | handlers.RingChannel[zenoh.Sample]
        channel = handlers.FifoChannel(MOST_WAITING) if self._keep == "all" else self._ring()
        if not topic.latched:
            return session.declare_subscriber(key, channel)
        history = ext.HistoryConfig(max_samples=1, detect_late_publishers=True)
        return ext.declare_advanced_subscriber(session, key, channel, history=history)

    def _declare_copies(self, session: zenoh.Session) -> "dict[str, _Subscriber]":
        return {
            name: session.declare_subscriber(prompt_key(f"{self.namespace}/{name}"), self._ring())
            for name in self._overtaken
        }

    def _ring(self) -> "handlers.RingChannel[zenoh.Sample]":
        return handlers.RingChannel(_RECENT if self._keep == "recent" else 1)

    def drain(self, most: Mapping[str, int] | None = None) -> list[Sample]:
        """Return every waiting sample, in order of arrival within a topic, at most `most` of it by its name.

        Without that limit a fast sender could keep it from ending. Copies that have overtaken their messages come last,
        and the messages do not come any more.
        """
        samples, self._early = self._early, []
        self.cut.clear()
        for topic, form, gaps, subscriber in self._subscribers:
            receive = subscriber.try_recv
            for _ in repeat(None) if most is None else repeat(None, most[topic.name]):
                if (raw := receive()) is None:
                    break
                sample = self._accept(topic, form, gaps, raw)
                if sample is not None:
                    samples.append(sample)
            else:
                self.cut.add(topic.name)
            if topic.name in self._copies:
                samples += self._copies_of(topic, form, gaps)
        return samples

    def _copies_of(self, topic: Topic, form: Wellformed, gaps: SequenceGaps) -> Iterator[Sample]:
        """Yield the waiting prompt copies of messages that have not come yet."""
        for _ in range(_RECENT):
            if (raw := self._copies[topic.name].try_recv()) is None:
                return
            payload, numbered = self._checked(topic, form, raw)
            if payload is None or numbered is None:
                continue
            publisher, sequence = numbered.publisher, numbered.sequence
            if gaps.is_ahead(publisher, sequence) and not self._overtaken[topic.name].holds(publisher, sequence):
                self._overtaken[topic.name].note(publisher, sequence)
                yield Sample(topic, payload, *numbered, 0, self.namespace)

    def take_report(self, sent: LastSent) -> int:
        """Take a publisher's report of its last message, when all that has arrived of it was drained.

        Returns:
            Number of newly known missing messages.
        """
        missing = sum(
            gaps.take_report(sent.publisher, sent.sequence)
            for topic, _, gaps, _ in self._subscribers
            if topic.name == sent.topic
        )
        self._count_lost(missing)
        return missing

    def messages(self) -> Iterator[tuple[Sample, Message]]:
        """Yield every waiting sample, decoded; unusable ones are counted and left out."""
        for sample in self.drain():
            try:
                message = sample.decode()
            except PayloadError as error:
                self._counters.reject(f"{sample.topic.name}: {error}")
                continue
            yield sample, message

    def wait(self, timeout_s: float) -> list[Sample]:
        """Wait up to ``timeout_s`` for samples to arrive, then :meth:`drain`."""
        deadline = time.monotonic() + timeout_s
        while not (samples := self.drain()) and time.monotonic() < deadline:
            time.sleep(_POLL_S)
        return samples

    def _accept(self, topic: Topic, form: Wellformed, gaps: SequenceGaps, raw: zenoh.Sample) -> Sample | None:
        payload, numbered = self._checked(topic, form, raw)
        if payload is None:
            return None
        self._counters.received += 1
        if numbered is None:
            return Sample(topic, payload, 0, 0, b"", 0, self.namespace)
        missed = gaps.missed(numbered.publisher, numbered.sequence)
        if missed < 0:
            return None
        self._count_lost(missed)
        if topic.name in self._overtaken and self._overtaken[topic.name].holds(numbered.publisher, numbered.sequence):
            return None
        return Sample(topic, payload, *numbered, missed, self.namespace)

    def _checked(
        self, topic: Topic, form: Wellformed, raw: zenoh.Sample
    ) -> tuple[bytes | None, attachment.Attachment | None]:
        """Return payload and numbers of a sample; no payload if it cannot be used, an empty one if it only skims."""
        attached = raw.attachment.to_bytes() if raw.attachment is not None else b""
        numbered = attachment.unpack(attached)
        if numbered is not None and self._looked_lately(topic, numbered.publisher):
            return b"", numbered
        payload = raw.payload.to_bytes()
        intact = attachment.is_intact(attached, self._key_sums[topic.name], payload)
        if problem := form.problem(payload) if intact else "damaged on the way":
            self.rejected[topic.name] = self.rejected.get(topic.name, 0) + 1
            self._counters.reject(f"{topic.name}: {problem}")
            return None, numbered
        return payload, numbered

    def _looked_lately(self, topic: Topic, publisher: bytes) -> bool:
        """Return whether a sample of this publisher need not be looked into; if so, the next one may be due."""
        if not self._every_s:
            return False
        now_s, key = time.monotonic(), (topic.name, publisher)
        if now_s - self._looked_s.get(key, -math.inf) < self._every_s:
            return True
        if len(self._looked_s) >= _PUBLISHERS:
            self._looked_s.clear()
        self._looked_s[key] = now_s
        return False

    def _count_lost(self, missed: int) -> None:
        if self._keep != "latest":
            self.lost += missed
        if self._keep == "all":
            self._counters.lost += missed
