"""Reading recordings, whole or broken off: whatever was written before the break is given."""

import struct
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

from mcap.data_stream import ReadDataStream
from mcap.exceptions import InvalidMagic, McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Footer, Header, Metadata, Schema
from mcap.stream_reader import MAGIC_SIZE, StreamReader, get_chunk_data_stream

from services.bridge.output import RecordingError

_RECORD_HEAD = struct.Struct("<BQ")
_MESSAGE_HEAD = struct.Struct("<HIQQ")
#: A record longer than this is taken for damage, not allocated.
_LARGEST_RECORD_BYTES = 256 * 1024 * 1024


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
            self._stream = path.open("rb")
        except OSError as error:
            raise RecordingError(f"{path}: cannot read the recording: {error.strerror}") from error
        self.summary = Summary(path, path.stat().st_size)
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, str] = {}
        self._begun = False

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
            records = StreamReader(self._stream, emit_chunks=True, record_size_limit=_LARGEST_RECORD_BYTES).records
            while (record := self._next(records)) is not None:
                if isinstance(record, Header):
                    self._begun = True
                    self.summary.profile = record.profile
                elif isinstance(record, Metadata):
                    self.summary.metadata[record.name] = dict(record.metadata)
                elif isinstance(record, (Schema, Channel)):
                    self._register(record)
                elif isinstance(record, Footer):
                    self.summary.complete = record.summary_start > 0
                elif isinstance(record, Chunk):
                    body = self._unpacked(record)
                    if body is None:
                        return
                    yield from self._chunk_messages(body, topics)

    def _next(self, records: Iterator[Any]) -> Any:
        """The next record, or None at the end or the break."""
        try:
            return next(records, None)
        except (McapError, ValueError, struct.error) as error:
            if (isinstance(error, InvalidMagic) and not self._begun) or self.summary.size_bytes < MAGIC_SIZE:
                raise RecordingError(f"{self.summary.path}: is not an MCAP recording") from error
            self.summary.problem = "broken off"
            return None

    def _unpacked(self, chunk: Chunk) -> bytes | None:
        try:
            stream, length = get_chunk_data_stream(chunk, validate_crc=True)
            return stream.read(length)
        except Exception as error:  # noqa: BLE001, each compressor raises its own kind
            self.summary.problem = f"broken off in a chunk ({error})"
            return None

    def _register(self, record: Schema | Channel) -> None:
        if isinstance(record, Schema):
            self._schemas[record.id] = record
        elif record.id not in self._channels:
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
            opcode, length = _RECORD_HEAD.unpack_from(body, offset)
            start = offset + _RECORD_HEAD.size
            offset = start + length
            if opcode == Opcode.MESSAGE:
                channel, sequence, log_time_ns, _ = _MESSAGE_HEAD.unpack_from(body, start)
                name = self._channels[channel]
                if topics is None or name in topics:
                    payload = body[start + _MESSAGE_HEAD.size : offset]
                    self._count(name, log_time_ns, len(payload))
                    yield Recorded(name, log_time_ns, sequence, payload)
            elif opcode == Opcode.SCHEMA:
                self._register(Schema.read(ReadDataStream(BytesIO(body[start:offset]))))
            elif opcode == Opcode.CHANNEL:
                self._register(Channel.read(ReadDataStream(BytesIO(body[start:offset]))))

    def _count(self, name: str, log_time_ns: int, size: int) -> None:
        topic = self.summary.topics[name]
        topic.first_ns = min(topic.first_ns, log_time_ns) if topic.messages else log_time_ns
        topic.last_ns = max(topic.last_ns, log_time_ns)
        topic.messages += 1
        topic.bytes += size


def read_summary(path: Path) -> Summary:
    """What the recording at ``path`` holds, by reading it through.

    Raises:
        RecordingError: The file cannot be opened or is not MCAP.
    """
    reader = RecordingReader(path)
    for _ in reader.messages():
        pass
    return reader.summary
