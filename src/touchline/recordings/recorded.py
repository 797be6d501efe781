"""Data types of recording readers: messages, payload kinds, losses and summaries."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

#: Losses that are reported one by one; the others are added up.
LOSSES_LISTED = 3
#: Losses that are remembered; later ones are added to the last one.
MOST_LOSSES = 1000
#: Description of a file that just stops.
NO_END = "broken off, or still being written"

#: Error handler that turns schema bytes that are no UTF-8, as Protobuf's, into text and back.
SCHEMA_ERRORS = "surrogateescape"


class Damage(ValueError):
    """Reason why a part of a recording cannot be read."""


@dataclass(frozen=True)
class RecordingKind:
    """Encoding and type of the payloads of a channel.

    Attributes:
        encoding: Encoding of the messages: ``cdr``, ``json``, ``protobuf`` …
        type: Name of the schema, for ROS the type: ``sensor_msgs/msg/Imu``; empty if there is none.
        schema_encoding: ``ros2msg``, ``jsonschema`` …
        schema: The definition, bytes that are no text as in `SCHEMA_ERRORS`; empty if there is none.
    """

    encoding: str = ""
    type: str = ""
    schema_encoding: str = ""
    schema: str = ""


class Recorded(NamedTuple):
    """One message of a recording.

    Attributes:
        topic: As recorded: ``/tt2/gnss/fix``.
        log_time_ns: Time of recording.
        publish_time_ns: Time of its stamp; without one, the time of recording.
        sequence: Sequence number of its publisher.
        payload: Its bytes.
        kind: Encoding and type.
    """

    topic: str
    log_time_ns: int
    publish_time_ns: int
    sequence: int
    payload: bytes
    kind: RecordingKind


@dataclass
class Loss:
    """Part of a recording that cannot be read.

    Attributes:
        what: Kind of damage, and its place in the file.
        messages: Number of lost messages; None if unknown.
        from_ns, to_ns: Their log times, as far as the file has them; else equal and 0.
    """

    what: str
    messages: int | None = None
    from_ns: int = 0
    to_ns: int = 0

    def __str__(self) -> str:
        """Return it as one line for a person."""
        if self.messages is None:
            lost = "an unknown number of messages is lost"
        else:
            lost = f"{self.messages:,} message{' is' if self.messages == 1 else 's are'} lost"
        when = f" from {self.from_ns / 1e9:.3f} s to {self.to_ns / 1e9:.3f} s" if self.to_ns else ""
        return f"{lost}{when} ({self.what})"


class Attached(NamedTuple):
    """File attached to a recording.

    Attributes:
        name: Name given by its writer.
        media_type: ``application/json`` …; empty if not given.
        log_time_ns: Time at which it was attached.
        create_time_ns: Time at which it was made; 0 if not given.
        size_bytes: Size of its data.
        file: The recording's file that holds it.
        at_byte: Where its data begin there.
    """

    name: str
    media_type: str
    log_time_ns: int
    create_time_ns: int
    size_bytes: int
    file: Path
    at_byte: int


@dataclass
class FileSummary:
    """Summary of one file of a recording.

    Attributes:
        complete: Whether it was finished with its index.
        losses: Parts that could not be read.
    """

    path: Path
    size_bytes: int
    messages: int
    complete: bool
    losses: list[Loss]


@dataclass
class TopicSummary:
    """Summary of one topic of a recording."""

    kind: RecordingKind
    metadata: dict[str, str]
    messages: int = 0
    bytes: int = 0
    first_ns: int = 0
    last_ns: int = 0

    @property
    def ros_type(self) -> str:
        """Name of the type; empty if there is none."""
        return self.kind.type

    @property
    def schema(self) -> str:
        """The definition; empty if there is none."""
        return self.kind.schema


@dataclass
class Summary:
    """Contents of a recording.

    Attributes:
        complete: Whether it was finished with its index; a recording cut off by kill -9 or a full disk was not.
        ending: Why reading ended early; empty if it did not.
        cut_bytes: Bytes of incomplete records at the ends of files.
        losses: Parts that could not be read, and were skipped.
        topics: By topic name, in the order of their channels.
        files: Summaries of the files that were read, in order.
        attachments: Attached files, of which only the place has been read.
        metadata: Metadata records by name; a repeated name gets its file's name appended.
    """

    path: Path
    size_bytes: int
    profile: str = ""
    complete: bool = False
    ending: str = ""
    cut_bytes: int = 0
    losses: list[Loss] = field(default_factory=list)
    topics: dict[str, TopicSummary] = field(default_factory=dict)
    files: list[FileSummary] = field(default_factory=list)
    attachments: list[Attached] = field(default_factory=list)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)

    @property
    def problem(self) -> str:
        """Description of what is missing and why; empty if all could be read."""
        texts = [str(loss) for loss in self.losses[:LOSSES_LISTED]]
        rest = self.losses[LOSSES_LISTED:]
        if rest:
            counted = sum(loss.messages or 0 for loss in rest)
            least = "at least " if any(loss.messages is None for loss in rest) else ""
            texts.append(f"{least}{counted:,} more at {len(rest):,} other places")
        return "; ".join([*texts, self.ending] if self.ending else texts)

    @property
    def messages(self) -> int:
        """Number of messages of all topics."""
        return sum(topic.messages for topic in self.topics.values())

    @property
    def duration_s(self) -> float:
        """Time from the first to the last message."""
        held = [topic for topic in self.topics.values() if topic.messages]
        if not held:
            return 0.0
        return (max(topic.last_ns for topic in held) - min(topic.first_ns for topic in held)) / 1e9

    def lose(self, loss: Loss) -> None:
        """Add a loss to the summary."""
        if len(self.losses) < MOST_LOSSES:
            self.losses.append(loss)
        elif loss.messages is None:
            self.losses[-1].messages = None
        elif (last := self.losses[-1]).messages is not None:
            last.messages += loss.messages

    def note(self, name: str, values: dict[str, str], file_name: str) -> None:
        """Add a metadata record."""
        again = self.metadata.get(name, values) != values
        self.metadata[f"{name} of {file_name}" if again else name] = values

    def define(self, topic: str, kind: RecordingKind, metadata: dict[str, str]) -> None:
        """Add a topic, unless it is known."""
        self.topics.setdefault(topic, TopicSummary(kind, metadata))

    def count(self, topic: str, log_time_ns: int, size_bytes: int) -> None:
        """Add a message of a known topic."""
        held = self.topics[topic]
        if not held.messages or log_time_ns < held.first_ns:
            held.first_ns = log_time_ns
        if log_time_ns > held.last_ns:
            held.last_ns = log_time_ns
        held.messages += 1
        held.bytes += size_bytes

    def count_many(self, topic: str, span_ns: tuple[int, int], messages: int, size_bytes: int) -> None:
        """Add several messages, whose log times are from the first to the last of `span_ns`."""
        self.count(topic, span_ns[0], size_bytes)
        held = self.topics[topic]
        held.last_ns = max(held.last_ns, span_ns[1])
        held.messages += messages - 1
