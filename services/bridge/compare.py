"""Are two recordings the same? Bytes first; where they differ, field by field within the topic's tolerance."""

import math
from collections import deque
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from schemas.cdr import decode
from schemas.errors import PayloadError
from schemas.messages import Message
from schemas.topics import Topic
from services.bridge.channels import topic_at
from services.bridge.output import RecordingError
from services.bridge.reader import Recorded, RecordingReader

#: Differences kept per topic; the rest is only counted.
DIFFERENCES_SHOWN = 3
#: Bytes of messages that wait for their partners at once: more than two sessions of a day are ever apart.
MOST_WAITING_BYTES = 1024**3


@dataclass(frozen=True)
class Difference:
    """A field of the ``index``-th message of a topic that differs by more than its tolerance."""

    index: int
    log_time_ns: int
    field: str
    left: str
    right: str

    def __str__(self) -> str:
        """One line for a person."""
        return f"message {self.index} at {self.log_time_ns / 1e9:.3f} s: {self.field}: {self.left} against {self.right}"


@dataclass
class TopicComparison:
    """How the messages of one topic compare, the first with the first and so on.

    Attributes:
        left, right: Messages in each recording.
        identical: Pairs with the same bytes.
        within_tolerance: Pairs with other bytes, but equal fields or no number further apart than the tolerance.
        different: The other pairs.
        largest: Largest difference of a number, among all pairs.
        first: The first few differences.
    """

    left: int = 0
    right: int = 0
    identical: int = 0
    within_tolerance: int = 0
    different: int = 0
    largest: float = 0.0
    first: list[Difference] = field(default_factory=list)

    @property
    def same(self) -> bool:
        """Whether both have the same messages, within the tolerance."""
        return self.left == self.right and not self.different


@dataclass
class Comparison:
    """Two recordings compared.

    Attributes:
        topics: By ROS topic name, sorted.
        problems: Why a recording could not be read to its end.
    """

    topics: dict[str, TopicComparison]
    problems: list[str]

    @property
    def identical(self) -> bool:
        """Whether every topic has the same messages, byte for byte, and both recordings could be read whole."""
        return self.same and not any(topic.within_tolerance for topic in self.topics.values())

    @property
    def same(self) -> bool:
        """Whether every topic has the same messages, within its tolerance."""
        return not self.problems and all(topic.same for topic in self.topics.values())

    def lines(self) -> Iterator[str]:
        """A short account: problems, then counts and first differences of each topic that is not identical."""
        yield from self.problems
        pairs = sum(topic.identical for topic in self.topics.values())
        yield f"{pairs} messages of {len(self.topics)} topics are identical"
        for name, topic in self.topics.items():
            if topic.left != topic.right:
                yield f"{name}: {topic.left} messages against {topic.right}"
            if topic.within_tolerance:
                yield f"{name}: {topic.within_tolerance} differ within the tolerance (largest {topic.largest:.3g})"
            if topic.different:
                yield f"{name}: {topic.different} differ (largest {topic.largest:.3g})"
                yield from (f"  {difference}" for difference in topic.first)


def compare(left: Path, right: Path, topics: Collection[str] | None = None) -> Comparison:
    """Compare two recordings message by message.

    The messages of each topic are paired in their order; how topics interleave is not compared, as it depends on the
    order in which processes were heard. Both files are read once, side by side.

    Args:
        left: The one to compare with.
        right: The other.
        topics: ROS topic names to compare; all if not given.

    Raises:
        RecordingError: A file cannot be opened or is not MCAP, or neither has a message of a topic asked for.
    """
    readers = (RecordingReader(left), RecordingReader(right))
    found: dict[str, TopicComparison] = {}
    waiting: tuple[dict[str, deque[Recorded]], dict[str, deque[Recorded]]] = ({}, {})
    waiting_bytes = 0
    for side, message in _alternating([reader.messages(topics) for reader in readers]):
        topic = found.setdefault(message.topic, TopicComparison())
        if side == 0:
            topic.left += 1
        else:
            topic.right += 1
        partners = waiting[1 - side].get(message.topic)
        if not partners:
            waiting[side].setdefault(message.topic, deque()).append(message)
            waiting_bytes += len(message.payload)
            if waiting_bytes > MOST_WAITING_BYTES:
                raise RecordingError(
                    f"{message.topic}: the recordings are too far apart; at most {MOST_WAITING_BYTES:,} bytes of "
                    "messages wait for their like"
                )
            continue
        partner = partners.popleft()
        waiting_bytes -= len(partner.payload)
        _compare_pair(topic, *((message, partner) if side == 0 else (partner, message)))
    absent = sorted(set(topics or ()) - found.keys())
    if absent:
        raise RecordingError(f"neither recording has a message of {', '.join(absent)}; `touchline topics` lists all")
    problems = [f"{r.summary.path}: {r.summary.problem}" for r in readers if r.summary.problem]
    return Comparison(dict(sorted(found.items())), problems)


def _alternating(sources: Sequence[Iterator[Recorded]]) -> Iterator[tuple[int, Recorded]]:
    """(side, message) from each source in turn, until both have ended."""
    going = dict(enumerate(sources))
    while going:
        for side in list(going):
            message = next(going[side], None)
            if message is None:
                del going[side]
            else:
                yield side, message


def _compare_pair(found: TopicComparison, left: Recorded, right: Recorded) -> None:
    if left.payload == right.payload:
        found.identical += 1
        return
    index = found.identical + found.within_tolerance + found.different
    topic = topic_at(left.topic)
    unequal = _unequal_fields(topic, left.payload, right.payload)
    found.largest = max([found.largest, *(size for _, _, _, size in unequal if math.isfinite(size))])
    tolerance = topic.tolerance if topic else 0.0
    beyond = [item for item in unequal if not item[3] <= tolerance]
    if not beyond:
        found.within_tolerance += 1
        return
    found.different += 1
    if len(found.first) < DIFFERENCES_SHOWN:
        name, one, other, _ = max(beyond, key=lambda item: item[3])
        found.first.append(Difference(index, left.log_time_ns, name, one, other))


def _unequal_fields(topic: Topic | None, left: bytes, right: bytes) -> list[tuple[str, str, str, float]]:
    """(field, left, right, size of the difference) of fields that are not equal; infinite for what is not a number."""
    if topic is None:
        return [("payload", f"{len(left)} bytes", f"{len(right)} bytes", math.inf)]
    try:
        return list(_walk("", decode(topic.type, left), decode(topic.type, right)))
    except PayloadError as error:
        return [("payload", str(error), "", math.inf)]


def _walk(path: str, left: object, right: object) -> Iterator[tuple[str, str, str, float]]:
    if isinstance(left, Message) and isinstance(right, Message):
        for name in type(left).model_fields:
            yield from _walk(f"{path}.{name}" if path else name, getattr(left, name), getattr(right, name))
    elif isinstance(left, (tuple, np.ndarray)) and isinstance(right, (tuple, np.ndarray)):
        if len(left) != len(right):
            yield f"{path} (length)", str(len(left)), str(len(right)), math.inf
            return
        for index, (one, other) in enumerate(zip(left, right, strict=True)):
            yield from _walk(f"{path}[{index}]", one, other)
    elif isinstance(left, (float, np.floating)) and isinstance(right, (float, np.floating)):
        yield from _numbers(path, float(left), float(right))
    elif left != right:
        yield path, repr(left), repr(right), math.inf


def _numbers(path: str, left: float, right: float) -> Iterator[tuple[str, str, str, float]]:
    if left == right or (math.isnan(left) and math.isnan(right)):
        return
    size = abs(left - right)
    yield path, repr(left), repr(right), math.inf if math.isnan(size) else size
