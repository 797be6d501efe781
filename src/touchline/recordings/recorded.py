"""Data types of recording readers: messages, payload kinds, losses and summaries."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

#: Losses that are told one by one; the rest is added up.
LOSSES_TOLD = 3
#: Losses that are remembered; what comes after them is added to the last one.
MOST_LOSSES = 1000
#: What is said of a file that just stops.
NO_END = "broken off, or still being written"

#: How bytes of a schema that are no UTF-8, as Protobuf's, become text and bytes again.
SCHEMA_ERRORS = "surrogateescape"


class Damage(ValueError):
    """Why a part of a recording cannot be read."""


@dataclass(frozen=True)
class RecordingKind:
    """How the payloads of a channel are to be read.

    Attributes:
        encoding: Of the messages: ``cdr``, ``json``, ``protobuf`` …
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
        topic: As written: ``/tt2/gnss/fix``.
        log_time_ns: When the recorder took it.
        publish_time_ns: When it was made: the time of its stamp; when it was recorded, if the recorder did not say.
        sequence: Its publisher's count.
        payload: Its bytes.
        kind: How to read them.
    """

    topic: str
    log_time_ns: int
    publish_time_ns: int
    sequence: int
    payload: bytes
    kind: RecordingKind


@dataclass
class Loss:
    """A part of a recording that cannot be read.

    Attributes:
        what: What is wrong, and where in the file.
        messages: How many messages are gone with it; None if nobody can tell.
        from_ns, to_ns: Their log times, as far as the file says; equal and 0 if it does not.
    """

    what: str
    messages: int | None = None
    from_ns: int = 0
    to_ns: int = 0

    def __str__(self) -> str:
        """One line for a person."""
        if self.messages is None:
            lost = "an unknown number of messages is lost"
        else:
            lost = f"{self.messages:,} message{' is' if self.messages == 1 else 's are'} lost"
        when = f" from {self.from_ns / 1e9:.3f} s to {self.to_ns / 1e9:.3f} s" if self.to_ns else ""
        return f"{lost}{when} ({self.what})"


class Attached(NamedTuple):
    """A file that is attached to a recording.

    Attributes:
        name: As its writer called it.
        media_type: ``application/json`` …; empty if its writer did not say.
        log_time_ns: When it was attached.
        create_time_ns: When it was made; 0 if its writer did not say.
        size_bytes: Of its data.
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
    """What was read of one file of a recording.

    Attributes:
        complete: Whether it was finished with its index.
        losses: What is wrong with it.
    """

    path: Path
    size_bytes: int
    messages: int
    complete: bool
    losses: list[Loss]


@dataclass
class TopicSummary:
    """What a recording holds of one topic."""

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
    """What a recording holds.

    Attributes:
        complete: Whether it was finished with its index; a recording broken off by kill -9 or a full disk was not.
        ending: Why reading ended early; empty if it did not.
        cut_bytes: Bytes of the records with which files end early, and that are not whole.
        losses: Parts that could not be read, and were passed over.
        topics: By topic name, in the order of their channels.
        files: What was read of each file, in their order, as far as they have been read.
        attachments: Files that are attached, of which only the place has been read.
        metadata: Metadata records by name; one that is there already has its file's name behind its own.
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
        """What is missing and why; empty if all could be read."""
        told = [str(loss) for loss in self.losses[:LOSSES_TOLD]]
        rest = self.losses[LOSSES_TOLD:]
        if rest:
            counted = sum(loss.messages or 0 for loss in rest)
            least = "at least " if any(loss.messages is None for loss in rest) else ""
            told.append(f"{least}{counted:,} more at {len(rest):,} other places")
        return "; ".join([*told, self.ending] if self.ending else told)

    @property
    def messages(self) -> int:
        """Messages of all topics."""
        return sum(topic.messages for topic in self.topics.values())

    @property
    def duration_s(self) -> float:
        """Time from the first to the last message."""
        held = [topic for topic in self.topics.values() if topic.messages]
        if not held:
            return 0.0
        return (max(topic.last_ns for topic in held) - min(topic.first_ns for topic in held)) / 1e9

    def lose(self, loss: Loss) -> None:
        """Add a loss."""
        if len(self.losses) < MOST_LOSSES:
            self.losses.append(loss)
        elif loss.messages is None:
            self.losses[-1].messages = None
        elif (last := self.losses[-1]).messages is not None:
            last.messages += loss.messages

    def note(self, name: str, values: dict[str, str], file_name: str) -> None:
        """Take up a metadata record."""
        again = self.metadata.get(name, values) != values
        self.metadata[f"{name} of {file_name}" if again else name] = values

    def define(self, topic: str, kind: RecordingKind, metadata: dict[str, str]) -> None:
        """Take up a topic, unless it is known."""
        self.topics.setdefault(topic, TopicSummary(kind, metadata))

    def count(self, topic: str, log_time_ns: int, size_bytes: int) -> None:
        """Add a message of a topic that is known."""
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
