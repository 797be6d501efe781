"""Sequential reader of one MCAP file that skips damaged parts."""

import re
import struct
from collections import Counter
from collections.abc import Collection, Iterator
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, NamedTuple, TypeVar

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Footer, Metadata, Schema, Statistics
from mcap.records import Header as FileHeader
from mcap.writer import MCAP0_MAGIC

from touchline.recordings.attachments import LONGEST_ATTACHMENT_HEAD_BYTES, attachment_at
from touchline.recordings.record_search import next_record
from touchline.recordings.recorded import NO_END, SCHEMA_ERRORS, Damage, Loss, Recorded, RecordingKind, Summary
from touchline.recordings.recording_file import RecordingError
from touchline.recordings.sealing import SEAL
from touchline.recordings.unpack import LARGEST_CHUNK_BYTES, unpacked

R = TypeVar("R", FileHeader, Footer, Metadata, Chunk, Schema, Channel, Statistics)

_RECORD_HEAD = struct.Struct("<BQ")
RECORD_HEAD_BYTES = _RECORD_HEAD.size
MESSAGE_HEAD = struct.Struct("<HIQQ")
_INDEX_HEAD = struct.Struct("<HI")
_INDEX_ENTRY_BYTES = 16
_FOOTER_BYTES = _RECORD_HEAD.size + 20 + len(MCAP0_MAGIC)
_READ = frozenset(
    (
        Opcode.HEADER,
        Opcode.FOOTER,
        Opcode.SCHEMA,
        Opcode.CHANNEL,
        Opcode.MESSAGE,
        Opcode.CHUNK,
        Opcode.METADATA,
        Opcode.STATISTICS,
    )
)
#: Opcodes from here on are private; unknown ones below are damage.
_PRIVATE = 0x80
_KNOWN = frozenset(Opcode)
#: A record longer than this is taken for damage, not allocated.
LARGEST_RECORD_BYTES = 64 * 1024 * 1024
#: Largest ratio of unpacked chunks to file size; the messages' indexes keep honest files far below.
LARGEST_RATIO = 200
LONGEST_NAME = 1000
#: Fields of a chunk before its compression: start, end, size and checksum.
_CHUNK_FIELDS_BYTES = 28
_CHUNK = re.compile(
    rb"\x06(?=.{4}\x00{4}.{28}(?:\x00{4}|\x03\x00\x00\x00lz4|\x04\x00\x00\x00zstd))", re.DOTALL
)  # shorter than 4 GiB
_CHUNK_SIGHT_BYTES = _RECORD_HEAD.size + _CHUNK_FIELDS_BYTES + 4 + 4 + 8
_SEARCH_BYTES = 1024 * 1024


class MessageRun(NamedTuple):
    """Message records that follow one another without a gap.

    Attributes:
        data: Bytes that hold them, among others.
        starts: Where the content of each begins there.
        end: End of the last one.
    """

    data: bytes
    starts: list[int]
    end: int


class McapFile:
    """One MCAP file; damaged parts are skipped and listed in the summary.

    Args:
        path: The file, for messages.
        stream: The open file, at its beginning; closed at the end.
        size_bytes: Its size.
        summary: Filled meanwhile; it may contain other files of the same recording.
    """

    def __init__(self, path: Path, stream: BinaryIO, size_bytes: int, summary: Summary) -> None:
        self._path = path
        self._stream = stream
        self._size_bytes = size_bytes
        self._summary = summary
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, tuple[str, RecordingKind]] = {}
        self._unknown: Counter[int] = Counter()
        self._summary_searched = False
        self.complete = False
        self.from_zero = False
        """True if a publish time of 0 is the beginning of sim time, and not an unset one."""
        self._unpacked_bytes = 0
        self._seen = 0
        self._stated: int | None = None
        """Number of messages by the file's statistics; None without them."""
        self._losses_before = len(summary.losses)
        self._record_at = 0
        self._indexed: tuple[Loss, Counter[int]] | None = None
        """A loss in the last chunk, and its readable messages by channel: their indexes show how many are lost."""

    def close(self) -> None:
        """Close the file before its end; harmless when repeated."""
        self._stream.close()

    @property
    def at_bytes(self) -> int:
        """Number of bytes read."""
        return self._size_bytes if self._stream.closed else self._stream.tell()

    def messages(self, topics: Collection[str] | None) -> Iterator[Recorded]:
        """Yield the messages, of ``topics`` only if given.

        Raises:
            RecordingError: The file is not MCAP.
        """
        for run in self.runs():
            yield from self._messages(run, topics)

    def runs(self) -> Iterator[MessageRun]:
        """Yield all messages as they are in the file. All have to be taken before the empty run at the end.

        Raises:
            RecordingError: The file is not MCAP.
        """
        with self._stream:
            begin = self._stream.read(len(MCAP0_MAGIC))
            if self._summary.files and begin != MCAP0_MAGIC and MCAP0_MAGIC.startswith(begin):
                self._summary.ending = NO_END  # a next part that has just been created
                yield MessageRun(b"", [], 0)
                return
            if begin != MCAP0_MAGIC:
                raise RecordingError(f"{self._path}: {_what_it_is(begin)}")
            going = True
            while going:
                try:
                    record = self._next()
                except Damage as damage:
                    self.complete = False
                    going = self._go_on_after(damage)
                else:
                    going = record is not None
                    if record is not None:
                        yield from self._taken(*record)
            yield MessageRun(b"", [], 0)
            self._check_count()
            behind = self._size_bytes - self._stream.tell()
            if self.complete and behind:
                self._summary.lose(Loss(f"{behind:,} bytes behind the end of {self._path.name}"))
            for channel, count in sorted(self._unknown.items()):
                self._summary.lose(Loss(f"of the unknown channel {channel}, which the file does not describe", count))

    def _next(self) -> tuple[int, bytes] | None:
        """Return opcode and content of the next relevant record; None after the file's footer."""
        while True:
            self._record_at = self._stream.tell()
            head = self._stream.read(_RECORD_HEAD.size)
            if len(head) < _RECORD_HEAD.size:
                raise Damage
            opcode, length = _RECORD_HEAD.unpack(head)
            remaining_bytes = self._size_bytes - self._record_at - _RECORD_HEAD.size
            if opcode == Opcode.MESSAGE_INDEX and self._indexed is not None and length <= remaining_bytes:
                self._count_indexed(self._stream.read(length))
                continue
            if opcode not in _READ:
                if length > remaining_bytes:
                    raise Damage
                if opcode not in _KNOWN and opcode < _PRIVATE:
                    self._pass_over(opcode)
                if opcode == Opcode.ATTACHMENT:
                    self._note_attachment(length)
                self._stream.seek(self._record_at + _RECORD_HEAD.size + length)
                continue
            if length > LARGEST_RECORD_BYTES:
                raise Damage(f"a record of {length:,} bytes; at most {LARGEST_RECORD_BYTES:,} are read")
            content = self._stream.read(length)
            if len(content) < length:
                raise Damage
            if opcode != Opcode.FOOTER:
                return opcode, content
            self.complete = self._parsed(Footer, content).summary_start > 0
            if self._stream.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
                raise Damage
            return None

    def _note_attachment(self, length: int) -> None:
        """Add an attached file to the summary; its data stay where they are."""
        begin = self._stream.tell()
        head = self._stream.read(min(length, LONGEST_ATTACHMENT_HEAD_BYTES))
        try:
            self._summary.attachments.append(attachment_at(self._path, begin, head, length))
        except Damage as damage:
            self._lose(damage, 0)

    def _pass_over(self, opcode: int) -> None:
        """Report a record of no known kind; if it was a chunk, the indexes behind it have its messages."""
        loss = Loss(f"a record of no known kind ({opcode:#04x}), at byte {self._record_at:,} of {self._path.name}")
        self._summary.lose(loss)
        self._indexed = loss, Counter()

    def _check_count(self) -> None:
        """Compare the file's message count with the messages that were read or reported as lost."""
        if self._stated is None:
            return
        losses = self._summary.losses[self._losses_before :]
        missing = max(self._stated - self._seen - sum(loss.messages or 0 for loss in losses), 0)
        uncounted = [loss for loss in losses if loss.messages is None]
        if missing == 0 or len(uncounted) == 1:
            for loss in uncounted:
                loss.messages = missing
        elif not uncounted:
            self._summary.lose(Loss(f"{self._path.name} should have {self._stated:,}", missing))

    def _go_on_after(self, damage: Damage) -> bool:
        """Skip what cannot be read, up to the next chunk or, without chunks, the next record; False at the end."""
        found = self._next_chunk_after(self._record_at)
        if found is None:
            found = next_record(self._stream, self._record_at + 1, self._size_bytes)
        reason = f"{damage}, " if str(damage) else ""
        if found is None:
            self._summary.cut_bytes += self._size_bytes - self._record_at
            self._summary.ending = f"{NO_END}{f' ({damage})' if str(damage) else ''}"
            return False
        where = f"{reason}bytes {self._record_at:,} to {found:,} of {self._path.name}"
        self._summary.lose(Loss(where))
        self._stream.seek(found)
        return True

    def _next_chunk_after(self, begin: int) -> int | None:
        """Return where the next record begins that is a chunk by its whole head."""
        self._indexed = None
        at = begin + 1
        while at + _CHUNK_SIGHT_BYTES <= self._size_bytes:
            self._stream.seek(at)
            block = self._stream.read(_SEARCH_BYTES + _CHUNK_SIGHT_BYTES)
            for sight in _CHUNK.finditer(block, 0, len(block)):
                if sight.start() < _SEARCH_BYTES and self._is_chunk(block, sight.start(), at):
                    return at + sight.start()
            at += _SEARCH_BYTES
        return None

    def _is_chunk(self, block: bytes, start: int, block_at: int) -> bool:
        _, length = _RECORD_HEAD.unpack_from(block, start)
        name_at = start + _RECORD_HEAD.size + _CHUNK_FIELDS_BYTES
        (name_bytes,) = struct.unpack_from("<I", block, name_at)
        if name_at + 4 + name_bytes + 8 > len(block):
            return False
        (records_bytes,) = struct.unpack_from("<Q", block, name_at + 4 + name_bytes)
        fits = block_at + start + _RECORD_HEAD.size + length <= self._size_bytes
        return bool(fits and length == _CHUNK_FIELDS_BYTES + 4 + name_bytes + 8 + records_bytes)

    def _taken(self, opcode: int, content: bytes) -> Iterator[MessageRun]:
        self._indexed = None
        if opcode == Opcode.CHUNK:
            yield from self._chunk(content)
            return
        if opcode == Opcode.MESSAGE:
            yield from self._content_alone(content, 0, len(content))
            return
        try:
            if opcode == Opcode.HEADER:
                header = self._parsed(FileHeader, content)
                self._summary.profile = header.profile
                self.from_zero = header.library.startswith("touchline")
            elif opcode == Opcode.METADATA:
                record = self._parsed(Metadata, content)
                if record.name != SEAL:  # of this file's bytes, not of what they mean
                    self._summary.note(record.name, dict(record.metadata), self._path.name)
            elif opcode == Opcode.STATISTICS:
                statistics = self._parsed(Statistics, content)
                if sum(statistics.channel_message_counts.values()) == statistics.message_count:
                    self._stated = statistics.message_count
            else:
                self._define(opcode, content)
        except Damage as damage:
            self._lose(damage, 0)

    def _define_or_lose(self, opcode: int, content: bytes) -> None:
        try:
            self._define(opcode, content)
        except Damage as damage:
            self._lose(damage, 0)

    def _chunk(self, content: bytes) -> Iterator[MessageRun]:
        """Yield the messages of a chunk, up to damage in it."""
        at, end = self._record_at, self._stream.tell()
        loss, chunk, body, good = Loss(""), None, b"", 0
        try:
            chunk = self._parsed(Chunk, content)
            loss.from_ns, loss.to_ns = chunk.message_start_time, chunk.message_end_time
            body = self._body(chunk)
            while good < len(body):
                run = _run_from(body, good)
                if run.starts:
                    self._seen += len(run.starts)
                    yield run
                good = run.end
                if good < len(body):
                    opcode, start, good = next(_records(body, good))
                    if opcode == Opcode.MESSAGE:
                        yield from self._content_alone(body, start, good)
                    elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                        self._define_or_lose(opcode, body[start:good])
        except Damage as damage:
            loss.what = f"{str(damage) or 'a chunk that ends early'}, at byte {at:,} of {self._path.name}"
            self._summary.lose(loss)
            # What the chunk's indexes have and could not be read before the damage is lost.
            read = Counter(MESSAGE_HEAD.unpack_from(body, start)[0] for start in _whole_messages(body[:good]))
            self._indexed = loss, read
            if chunk is None or _length_of(chunk) != len(content):  # then the next one may begin in it
                found = self._next_chunk_after(at)
                self._stream.seek(end if found is None else found)
        else:
            if _length_of(chunk) != len(content):  # complete, but the total length is wrong
                self._stream.seek(at + _RECORD_HEAD.size + _length_of(chunk))

    def _count_indexed(self, content: bytes) -> None:
        """Count the messages of a channel in a damaged chunk by its message index."""
        assert self._indexed is not None
        loss, read = self._indexed
        if len(content) < _INDEX_HEAD.size:
            return
        channel, length = _INDEX_HEAD.unpack_from(content)
        held = min(length, len(content) - _INDEX_HEAD.size) // _INDEX_ENTRY_BYTES
        loss.messages = (loss.messages or 0) + max(held - read[channel], 0)

    def _lose(self, damage: Damage, messages: int) -> None:
        """Report a loss in the record that was read last, or in one within it."""
        self._summary.lose(Loss(f"{damage}, at byte {self._record_at:,} of {self._path.name}", messages))

    def _define(self, opcode: int, content: bytes) -> None:
        """Take a schema or a channel.

        Raises:
            Damage: It cannot be read.
        """
        if opcode == Opcode.SCHEMA:
            schema = self._parsed(Schema, content)
            self._schemas[schema.id] = schema
            return
        channel = self._parsed(Channel, content)
        if channel.id in self._channels:
            return
        if len(channel.topic) > LONGEST_NAME:
            raise Damage(f"a topic's name of {len(channel.topic):,} characters; at most {LONGEST_NAME:,} are read")
        schema_of = self._schemas.get(channel.schema_id)
        kind = RecordingKind(channel.message_encoding)
        if schema_of is not None:
            text = schema_of.data.decode(errors=SCHEMA_ERRORS)
            kind = RecordingKind(channel.message_encoding, schema_of.name, schema_of.encoding, text)
        self._channels[channel.id] = channel.topic, kind
        self._summary.define(channel.topic, kind, dict(channel.metadata))

    def _body(self, chunk: Chunk) -> bytes:
        most = LARGEST_CHUNK_BYTES + LARGEST_RATIO * self._size_bytes
        if chunk.uncompressed_size <= LARGEST_CHUNK_BYTES and self._unpacked_bytes + chunk.uncompressed_size > most:
            raise Damage(f"chunks that hold more than {most:,} bytes, {LARGEST_RATIO} times what they take")
        body = unpacked(chunk)
        self._unpacked_bytes += len(body)
        return body

    def _content_alone(self, data: bytes, start: int, end: int) -> Iterator[MessageRun]:
        """Yield the message whose content is `data[start:end]`, if it has a head."""
        if start + MESSAGE_HEAD.size > end:
            self._lose(Damage("a message without its head"), 1)
            return
        self._seen += 1
        yield MessageRun(data, [start], end)

    def _messages(self, run: MessageRun, topics: Collection[str] | None) -> Iterator[Recorded]:
        """Yield the messages of a run, of ``topics`` only if given."""
        data, head, count = run.data, MESSAGE_HEAD.size, self._summary.count
        following = iter(run.starts)
        next(following, None)
        for start in run.starts:
            end = next(following, run.end + RECORD_HEAD_BYTES) - RECORD_HEAD_BYTES
            channel, sequence, log_time_ns, publish_time_ns = MESSAGE_HEAD.unpack_from(data, start)
            known = self._channels.get(channel) or self.channel_of(channel, 1)
            if known is None:
                continue
            name, kind = known
            if topics is not None and name not in topics:
                continue
            if not publish_time_ns and not self.from_zero:
                publish_time_ns = log_time_ns
            payload = data[start + head : end]
            count(name, log_time_ns, len(payload))
            yield Recorded(name, log_time_ns, publish_time_ns, sequence, payload, kind)

    def channel_of(self, channel: int, messages: int) -> tuple[str, RecordingKind] | None:
        """Return topic and kind of a channel with so many messages; if undescribed, they are counted as lost."""
        known = self._channels.get(channel) or self._channel_of_summary(channel)
        if known is None:
            self._unknown[channel] += messages
        return known

    def _channel_of_summary(self, channel: int) -> tuple[str, RecordingKind] | None:
        """Return a channel whose own record is lost, from the copies at the end of a complete file."""
        if not self._summary_searched:
            self._summary_searched = True
            back, before = self._stream.tell(), self._record_at
            with suppress(Damage):  # there is none
                self._read_summary_section()
            self._stream.seek(back)
            self._record_at = before
        return self._channels.get(channel)

    def _read_summary_section(self) -> None:
        footer_at = self._size_bytes - _FOOTER_BYTES
        if footer_at < len(MCAP0_MAGIC):
            return
        self._stream.seek(footer_at)
        opcode, length = _RECORD_HEAD.unpack(self._stream.read(_RECORD_HEAD.size))
        content = self._stream.read(20)
        if opcode != Opcode.FOOTER or length != len(content):
            return
        start = self._parsed(Footer, content).summary_start
        if not 0 < start < footer_at or footer_at - start > LARGEST_RECORD_BYTES:
            return
        self._stream.seek(start)
        section = self._stream.read(footer_at - start)
        for kind, begin, end in _records(section):
            if kind in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._define(kind, section[begin:end])

    @staticmethod
    def _parsed(kind: type[R], content: bytes) -> R:
        """Parse a record of that kind.

        Raises:
            Damage: It cannot be parsed.
        """
        try:
            record: R = kind.read(ReadDataStream(BytesIO(content)))
        except Exception as error:  # the library raises anything on bad bytes
            raise Damage(f"a {kind.__name__.lower()} record that cannot be read") from error
        return record


def _run_from(body: bytes, begin: int) -> MessageRun:
    """Return the whole messages from a byte on, up to the first record that is none.

    Parsed here and not by mcap, which takes several times as long per message.
    """
    at, size, unpack, starts = begin, len(body), _RECORD_HEAD.unpack_from, list[int]()
    message, least, add = int(Opcode.MESSAGE), MESSAGE_HEAD.size, starts.append
    while at + RECORD_HEAD_BYTES <= size:
        opcode, length = unpack(body, at)
        end = at + RECORD_HEAD_BYTES + length
        if opcode != message or length < least or end > size:
            break
        add(at + RECORD_HEAD_BYTES)
        at = end
    return MessageRun(body, starts, at)


def _records(body: bytes, offset: int = 0) -> Iterator[tuple[int, int, int]]:
    """Yield (opcode, start, end) of the content of each record in a chunk."""
    while offset < len(body):
        if offset + _RECORD_HEAD.size > len(body):
            raise Damage
        opcode, length = _RECORD_HEAD.unpack_from(body, offset)
        start = offset + _RECORD_HEAD.size
        offset = start + length
        if offset > len(body):
            raise Damage("a record that goes on beyond its chunk")
        yield opcode, start, offset


def _length_of(chunk: Chunk) -> int:
    """Return the length of a chunk's record by its contents, bytes."""
    return _CHUNK_FIELDS_BYTES + 4 + len(chunk.compression.encode()) + 8 + len(chunk.data)


def _whole_messages(body: bytes) -> Iterator[int]:
    """Yield where the messages in ``body`` begin, whose records are all whole."""
    for opcode, start, end in _records(body):
        if opcode == Opcode.MESSAGE and end - start >= MESSAGE_HEAD.size:
            yield start


def _what_it_is(begin: bytes) -> str:
    if begin.startswith(b"version "):
        return "is a Git LFS pointer and not the recording; `git lfs pull` gets that"
    if begin.startswith(b"#ROSBAG"):
        return "is a ROS 1 bag and not an MCAP recording; rosbags-convert makes one of it"
    return "is not an MCAP recording"
