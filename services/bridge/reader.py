"""Reading recordings, whole or broken off: whatever was written before the break is given."""

import os
import stat
import struct
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import TypeVar

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Footer, Metadata, Schema
from mcap.records import Header as FileHeader
from mcap.writer import MCAP0_MAGIC

from services.bridge.output import RecordingError
from services.bridge.unpack import LARGEST_CHUNK_BYTES, Damage, unpacked

R = TypeVar("R", FileHeader, Footer, Metadata, Chunk, Schema, Channel)

_RECORD_HEAD = struct.Struct("<BQ")
_MESSAGE_HEAD = struct.Struct("<HIQQ")
_READ = frozenset(
    (
        Opcode.HEADER,
        Opcode.FOOTER,
        Opcode.SCHEMA,
        Opcode.CHANNEL,
        Opcode.MESSAGE,
        Opcode.CHUNK,
        Opcode.METADATA,
    )
)
#: A record longer than this is taken for damage, not allocated.
LARGEST_RECORD_BYTES = 64 * 1024 * 1024
#: What all chunks of a file may unpack to, over its size; the indexes of the messages keep honest ones far below.
LARGEST_RATIO = 200
LONGEST_NAME = 1000


@dataclass(frozen=True, slots=True)
class Recorded:
    """One message of a recording: topic as written (``/tt2/gnss/fix``), sim time in ns, its publisher's sequence."""

    topic: str
    log_time_ns: int
    sequence: int
    payload: bytes


@dataclass
class TopicSummary:
    """What a recording holds of one topic."""

    ros_type: str
    schema: str
    metadata: dict[str, str]
    messages: int = 0
    bytes: int = 0
    first_ns: int = 0
    last_ns: int = 0


@dataclass
class Summary:
    """What a recording holds.

    Attributes:
        complete: Whether it was finished with its index; a recording broken off by kill -9 or a full disk was not.
        problem: Why reading ended early; empty if it did not.
        topics: By topic name, in the order of their channels.
        metadata: Metadata records by name.
    """

    path: Path
    size_bytes: int
    profile: str = ""
    complete: bool = False
    problem: str = ""
    topics: dict[str, TopicSummary] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)

    @property
    def messages(self) -> int:
        """Messages of all topics."""
        return sum(topic.messages for topic in self.topics.values())

    @property
    def duration_s(self) -> float:
        """Sim time from the first to the last message."""
        held = [topic for topic in self.topics.values() if topic.messages]
        if not held:
            return 0.0
        return (max(topic.last_ns for topic in held) - min(topic.first_ns for topic in held)) / 1e9


class RecordingReader:
    """Reads one recording from front to back, in the order in which it was written.

    Args:
        path: MCAP file.

    Attributes:
        summary: Filled while :meth:`messages` goes on; final once it has ended.

    Raises:
        RecordingError: The file cannot be opened or is not MCAP.
    """

    def __init__(self, path: Path) -> None:
        try:
            if not stat.S_ISREG(path.stat().st_mode):
                raise RecordingError(f"{path}: cannot read the recording: it is no file")
            self._stream = path.open("rb")
        except (OSError, ValueError) as error:  # ValueError: a path with a null byte
            reason = error.strerror if isinstance(error, OSError) else error
            raise RecordingError(f"{path}: cannot read the recording: {reason}") from error
        self.summary = Summary(path, os.fstat(self._stream.fileno()).st_size)
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, str] = {}
        self._unpacked_bytes = 0

    def close(self) -> None:
        """Close the file before its end; harmless when repeated."""
        self._stream.close()

    @property
    def fraction(self) -> float:
        """How much of the file has been read, 0…1."""
        return 1.0 if self._stream.closed else self._stream.tell() / max(self.summary.size_bytes, 1)

    def messages(self, topics: Collection[str] | None = None) -> Iterator[Recorded]:
        """The messages, of ``topics`` only if given (the summary then counts these).

        Raises:
            RecordingError: The file is not MCAP. Damage further on ends the iteration and is told in the summary.
        """
        with self._stream:
            if self._stream.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
                raise RecordingError(f"{self.summary.path}: is not an MCAP recording")
            try:
                while (record := self._next()) is not None:
                    yield from self._taken(*record, topics)
            except Damage as damage:
                self.summary.complete = False
                self.summary.problem = f"broken off ({damage})" if str(damage) else "broken off"

    def _next(self) -> tuple[int, bytes] | None:
        """The next record that says something: its opcode and content; None after the file's footer."""
        while True:
            head = self._stream.read(_RECORD_HEAD.size)
            if len(head) < _RECORD_HEAD.size:
                raise Damage
            opcode, length = _RECORD_HEAD.unpack(head)
            if opcode not in _READ:
                if length > self.summary.size_bytes:
                    raise Damage
                self._stream.seek(length, os.SEEK_CUR)
                continue
            if length > LARGEST_RECORD_BYTES:
                raise Damage(f"a record of {length:,} bytes; at most {LARGEST_RECORD_BYTES:,} are read")
            content = self._stream.read(length)
            if len(content) < length:
                raise Damage
            if opcode != Opcode.FOOTER:
                return opcode, content
            self.summary.complete = _parsed(Footer, content).summary_start > 0
            if self._stream.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
                raise Damage
            return None

    def _taken(self, opcode: int, content: bytes, topics: Collection[str] | None) -> Iterator[Recorded]:
        if opcode == Opcode.HEADER:
            self.summary.profile = _parsed(FileHeader, content).profile
        elif opcode == Opcode.METADATA:
            record = _parsed(Metadata, content)
            self.summary.metadata[record.name] = dict(record.metadata)
        elif opcode == Opcode.CHUNK:
            yield from self._chunk_messages(self._body(_parsed(Chunk, content)), topics)
        elif opcode == Opcode.MESSAGE:
            yield from self._message(content, 0, len(content), topics)
        else:
            self._define(opcode, content)

    def _define(self, opcode: int, content: bytes) -> None:
        """Take a schema or a channel."""
        self._register(_parsed(Schema, content) if opcode == Opcode.SCHEMA else _parsed(Channel, content))

    def _body(self, chunk: Chunk) -> bytes:
        body = unpacked(chunk)
        self._unpacked_bytes += len(body)
        most = LARGEST_CHUNK_BYTES + LARGEST_RATIO * self.summary.size_bytes
        if self._unpacked_bytes > most:
            raise Damage(f"its chunks hold more than {most:,} bytes, {LARGEST_RATIO} times what they take")
        return body

    def _register(self, record: Schema | Channel) -> None:
        if isinstance(record, Schema):
            self._schemas[record.id] = record
        elif record.id not in self._channels:
            if len(record.topic) > LONGEST_NAME:
                raise Damage(f"a topic's name of {len(record.topic):,} characters; at most {LONGEST_NAME:,} are read")
            schema = self._schemas.get(record.schema_id)
            self._channels[record.id] = record.topic
            self.summary.topics.setdefault(
                record.topic,
                TopicSummary(
                    schema.name if schema else "",
                    schema.data.decode(errors="replace") if schema else "",
                    dict(record.metadata),
                ),
            )

    def _chunk_messages(self, body: bytes, topics: Collection[str] | None) -> Iterator[Recorded]:
        # Parsed here and not by mcap, which takes several times as long per message.
        offset = 0
        while offset < len(body):
            if offset + _RECORD_HEAD.size > len(body):
                raise Damage
            opcode, length = _RECORD_HEAD.unpack_from(body, offset)
            start = offset + _RECORD_HEAD.size
            offset = start + length
            if offset > len(body):
                raise Damage("a record that goes on beyond its chunk")
            if opcode == Opcode.MESSAGE:
                yield from self._message(body, start, offset, topics)
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._define(opcode, body[start:offset])

    def _message(self, data: bytes, start: int, end: int, topics: Collection[str] | None) -> tuple[Recorded, ...]:
        """The message at ``data[start:end]``, if it is of one of ``topics``."""
        if start + _MESSAGE_HEAD.size > end:
            raise Damage("a message without its head")
        channel, sequence, log_time_ns, _ = _MESSAGE_HEAD.unpack_from(data, start)
        name = self._channels.get(channel)
        if name is None:
            raise Damage("a message of an unknown channel")
        if topics is not None and name not in topics:
            return ()
        payload = data[start + _MESSAGE_HEAD.size : end]
        self._count(name, log_time_ns, len(payload))
        return (Recorded(name, log_time_ns, sequence, payload),)

    def _count(self, name: str, log_time_ns: int, size: int) -> None:
        topic = self.summary.topics[name]
        topic.first_ns = min(topic.first_ns, log_time_ns) if topic.messages else log_time_ns
        topic.last_ns = max(topic.last_ns, log_time_ns)
        topic.messages += 1
        topic.bytes += size


def _parsed(kind: type[R], content: bytes) -> R:
    """The record of that kind in ``content``."""
    try:
        record: R = kind.read(ReadDataStream(BytesIO(content)))
    except Exception as error:  # whatever the bytes lead the library into
        raise Damage(f"a {kind.__name__.lower()} record that cannot be read") from error
    return record


def read_summary(path: Path) -> Summary:
    """What the recording at ``path`` holds, by reading it through.

    Raises:
        RecordingError: The file cannot be opened or is not MCAP.
    """
    reader = RecordingReader(path)
    for _ in reader.messages():
        pass
    return reader.summary
