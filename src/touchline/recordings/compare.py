"""Comparison of two recordings message by message, each field within its topic's tolerance."""

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from touchline.recordings.alignment import Alignment
from touchline.recordings.channels import is_drawn, present_path, recorded_paths, robots_among, topic_at
from touchline.recordings.field_differences import unequal_fields
from touchline.recordings.former_types import presented
from touchline.recordings.reader import RecordingReader
from touchline.recordings.recorded import Recorded, RecordingKind
from touchline.recordings.recording_file import RecordingError
from touchline.recordings.schema_change import SchemaChange, schema_change

#: Differences kept per topic; the others are only counted.
DIFFERENCES_SHOWN = 3
#: Largest total of waiting messages, bytes: two sessions of a day are never further apart.
MOST_WAITING_BYTES = 1024**3
#: Recordings that begin further apart were made by unrelated clocks.
_OTHER_CLOCK_NS = 24 * 3600 * 1_000_000_000


@dataclass(frozen=True)
class Difference:
    """Field of a pair of messages that differs by more than its tolerance.

    Attributes:
        index: Number of the pair in its topic.
        time_s: Time at which the message was made.
        field: Path of the field.
        left, right: Its values.
        unit: Unit of the values; empty if there is none.
    """

    index: int
    time_s: float
    field: str
    left: str
    right: str
    unit: str = ""

    def __str__(self) -> str:
        """Return it as one line for a person."""
        unit = f" {self.unit}" if self.unit else ""
        return f"message {self.index} at {self.time_s:.3f} s: {self.field}: {self.left} against {self.right}{unit}"


@dataclass
class Missing:
    """Messages of one recording without a counterpart in the other, and the times of the first and the last."""

    messages: int = 0
    first_s: float = 0.0
    last_s: float = 0.0

    def add(self, time_s: float) -> None:
        """Add a message that was made at this time."""
        self.first_s = min(self.first_s, time_s) if self.messages else time_s
        self.last_s = max(self.last_s, time_s)
        self.messages += 1

    def line(self, here: str, there: str) -> str:
        """Return it as a line for a person: present in ``here``, missing from ``there``."""
        if self.messages == 1:
            return f"1 message of {here}, made at {self.first_s:.3f} s, is missing from {there}"
        made = f"made from {self.first_s:.3f} s to {self.last_s:.3f} s"
        return f"{self.messages:,} messages of {here}, {made}, are missing from {there}"


@dataclass
class TopicComparison:
    """Comparison of one topic, each message with the one made at the same time.

    Attributes:
        left, right: Messages in each recording.
        missing_left, missing_right: Messages that only the other recording has.
        identical: Pairs with the same bytes, read by the same schema.
        within_tolerance: Pairs that differ, but by no number further than the tolerance.
        different: The other pairs.
        largest: Largest difference of a number, among all pairs; its field and unit.
        first: The first few differences.
        apart_s: Largest time between the two messages of a pair.
        schema: Differences between the schemas.
        compatible: Whether these are only fields which an older version lacks.
    """

    left: int = 0
    right: int = 0
    missing_left: Missing = field(default_factory=Missing)
    missing_right: Missing = field(default_factory=Missing)
    identical: int = 0
    within_tolerance: int = 0
    different: int = 0
    largest: float = 0.0
    largest_field: str = ""
    unit: str = ""
    first: list[Difference] = field(default_factory=list)
    apart_s: float = 0.0
    schema: list[str] = field(default_factory=list)
    compatible: bool = True

    @property
    def same(self) -> bool:
        """True if both have the same messages, within the tolerance."""
        missing = self.missing_left.messages + self.missing_right.messages
        return not missing and not self.different and self.compatible

    @property
    def pairs(self) -> int:
        """Number of messages with a counterpart."""
        return self.identical + self.within_tolerance + self.different

    def lines(self, name: str, sides: tuple[str, str]) -> Iterator[str]:
        """Yield lines of text about what is not identical."""
        yield from (f"{name}: {note}" for note in self.schema)
        if self.missing_right.messages:
            yield f"{name}: {self.missing_right.line(*sides)}"
        if self.missing_left.messages:
            yield f"{name}: {self.missing_left.line(*reversed(sides))}"
        largest = f"{self.largest:.3g}{f' {self.unit}' if self.unit else ''} in {self.largest_field}"
        if self.within_tolerance:
            how = f" (largest {largest})" if self.largest_field else ""
            yield f"{name}: {self.within_tolerance:,} of {self.pairs:,} differ within the tolerance{how}"
        if self.different:
            how = f" (largest {largest})" if self.largest_field else ""
            yield f"{name}: {self.different:,} of {self.pairs:,} differ{how}"
            yield from (f"  {difference}" for difference in self.first)
        if self.apart_s and self.identical < self.pairs:
            yield f"{name}: messages that belong together were made up to {self.apart_s:.3g} s apart"


@dataclass
class Comparison:
    """Two recordings compared.

    Attributes:
        names: Names of the two.
        topics: By ROS topic name, sorted.
        problems: Unreadable parts of a recording.
        notes: Further remarks.
    """

    names: tuple[str, str]
    topics: dict[str, TopicComparison]
    problems: list[str]
    notes: list[str] = field(default_factory=list)

    @property
    def identical(self) -> bool:
        """True if every topic has the same messages, byte for byte, and both recordings could be read whole."""
        return self.same and not any(t.within_tolerance or t.schema for t in self.topics.values())

    @property
    def same(self) -> bool:
        """True if every topic has the same messages, within its tolerance."""
        return not self.problems and all(topic.same for topic in self.topics.values())

    def lines(self) -> Iterator[str]:
        """Yield a short account: problems, then counts and first differences of each topic that is not identical."""
        yield from self.problems
        yield from self.notes
        pairs = sum(topic.identical for topic in self.topics.values())
        yield f"{pairs:,} messages of {len(self.topics)} topics are identical"
        if not self.topics:
            yield "neither recording holds a message"
        for name, topic in self.topics.items():
            yield from topic.lines(name, self.names)


class _Topic:
    """Comparison of a topic in progress."""

    def __init__(self, name: str, sides: tuple[str, str]) -> None:
        self.found = TopicComparison()
        self.alignment = Alignment()
        topic = topic_at(name)
        self._tolerance = topic.tolerance if topic else 0.0
        self._sides = sides
        self._changes: dict[tuple[RecordingKind, RecordingKind], SchemaChange] = {}

    def compare_decided(self, shift_ns: int) -> int:
        """Compare the pairs that are certain; return the bytes that wait no longer."""
        done_bytes = 0
        for left, right in self.alignment.decided():
            if left is not None and right is not None:
                self._compare(left, right, shift_ns)
            elif left is not None:
                self.found.missing_right.add(left.publish_time_ns / 1e9)
            elif right is not None:
                self.found.missing_left.add(right.publish_time_ns / 1e9)
            done_bytes += sum(len(message.payload) for message in (left, right) if message is not None)
        return done_bytes

    def _compare(self, left: Recorded, right: Recorded, shift_ns: int) -> None:
        found = self.found
        apart_ns = abs(left.publish_time_ns - right.publish_time_ns - shift_ns)
        found.apart_s = max(found.apart_s, apart_ns / 1e9)
        change = SchemaChange()
        if left.kind != right.kind:
            change = self._change(left.kind, right.kind)
        if left.payload == right.payload and not change.notes:
            found.identical += 1
            return
        index = found.pairs
        unequal = unequal_fields(left, right, change)
        for item in unequal:
            if math.isfinite(item.size) and item.size > found.largest:
                found.largest, found.largest_field, found.unit = item.size, item.field, item.unit
        beyond = [item for item in unequal if not item.size <= self._tolerance]
        if not beyond:
            found.within_tolerance += 1
            return
        found.different += 1
        if len(found.first) < DIFFERENCES_SHOWN:
            worst = max(beyond, key=lambda item: item.size)
            time_s = left.publish_time_ns / 1e9
            found.first.append(Difference(index, time_s, worst.field, worst.left, worst.right, worst.unit))

    def _change(self, left: RecordingKind, right: RecordingKind) -> SchemaChange:
        known = self._changes.get((left, right))
        if known is None:
            known = self._changes[left, right] = schema_change(left, right, self._sides)
            self.found.schema += [note for note in known.notes if note not in self.found.schema]
            self.found.compatible &= known.compatible
        return known


def compare(left: Path, right: Path, topics: Collection[str] | None = None) -> Comparison:
    """Compare two recordings message by message.

    Messages of a topic made at the same time belong together; how topics interleave is not compared, as it depends on
    the order in which processes were heard. Both recordings are read once, side by side.

    Args:
        left: The recording to compare with.
        right: The other recording.
        topics: ROS topic names to compare, also by a name of older recordings; None: all that robots send.

    Raises:
        RecordingError: A recording cannot be opened or is none, or neither has a message of a requested topic.
    """
    readers = (RecordingReader(left), RecordingReader(right))
    names = (str(left), str(right)) if left.name == right.name else (left.name, right.name)
    going: dict[str, _Topic] = {}
    begun_ns: dict[int, int] = {}
    ended: list[int] = []
    waiting_bytes = shift_ns = 0
    wanted = None if topics is None else {path for name in topics for path in recorded_paths(name)}
    for side, message in _alternating([map(presented, reader.messages(wanted)) for reader in readers]):
        if message is None:
            ended.append(side)
            for topic in going.values():
                topic.alignment.end(side)
                waiting_bytes -= topic.compare_decided(shift_ns)
            continue
        if side not in begun_ns:
            begun_ns[side] = message.publish_time_ns
            if len(begun_ns) == 2 and abs(begun_ns[0] - begun_ns[1]) > _OTHER_CLOCK_NS:
                shift_ns = begun_ns[0] - begun_ns[1]
        name = present_path(message.topic)
        if name not in going:
            going[name] = _Topic(name, names)
            for other in ended:
                going[name].alignment.end(other)
        topic = going[name]
        if side == 0:
            topic.found.left += 1
        else:
            topic.found.right += 1
        topic.alignment.add(side, message, shift_ns if side else 0)
        waiting_bytes += len(message.payload) - topic.compare_decided(shift_ns)
        if waiting_bytes > MOST_WAITING_BYTES:
            raise RecordingError(
                f"{name}: the recordings are too far apart; at most {MOST_WAITING_BYTES:,} bytes of "
                "messages wait for their counterparts"
            )
    robots = robots_among(going)
    if topics is None:  # viewers' topics follow from the rest, and older recordings have none
        going = {name: topic for name, topic in going.items() if not is_drawn(name, robots)}
    absent = sorted(name for name in set(topics or ()) if present_path(name) not in going)
    if absent:
        raise RecordingError(f"neither recording has a message of {', '.join(absent)}; `touchline topics` lists all")
    problems = [f"{r.summary.path}: {r.summary.problem}" for r in readers if r.summary.problem]
    notes = []
    if shift_ns:
        notes.append(f"{names[1]} begins {-shift_ns / 1e9:,.3f} s after {names[0]}: times are taken from the beginning")
    return Comparison(names, {name: topic.found for name, topic in sorted(going.items())}, problems, notes)


def _alternating(sources: Sequence[Iterator[Recorded]]) -> Iterator[tuple[int, Recorded | None]]:
    """Yield (side, message) from each source in turn, with None where one ends, until both have ended."""
    going = dict(enumerate(sources))
    while going:
        for side in list(going):
            message = next(going[side], None)
            if message is None:
                del going[side]
            yield side, message
