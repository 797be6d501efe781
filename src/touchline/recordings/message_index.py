"""Places of all messages of a recording, by the indexes of its MCAP files: for reading from anywhere."""

import struct
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Chunk, ChunkIndex
from mcap.summary import Summary as FileIndex
from numpy.typing import NDArray

from touchline.recordings.mcap_file import LARGEST_RECORD_BYTES
from touchline.recordings.parts import with_followers
from touchline.recordings.recorded import SCHEMA_ERRORS, Damage, Recorded, RecordingKind
from touchline.recordings.unpack import unpacked

_RECORD_HEAD = struct.Struct("<BQ")
_MESSAGE_HEAD = struct.Struct("<HIQQ")
_INDEX_HEAD = struct.Struct("<HI")
_ENTRY = np.dtype([("log_time_ns", "<u8"), ("offset", "<u8")])


class MessageIndex:
    """Messages of a recording of complete, indexed MCAP files, in their order; create it with `of`.

    Attributes:
        channels: Topic as recorded and kind of each channel, by the number in ``channel``.
        channel: Channel of each message.
        log_time_ns: Log time of each message.
    """

    def __init__(self, paths: list[Path]) -> None:
        """Read the indexes.

        Raises:
            Damage: A file has none, or an incomplete one.
        """
        self.channels: list[tuple[str, RecordingKind]] = []
        self._chunks: list[tuple[Path, ChunkIndex]] = []
        columns: list[NDArray[np.int64]] = []
        for path in paths:
            with path.open("rb") as stream:
                try:
                    columns.append(self._read_file(path, stream))
                except Exception as error:  # the library raises anything on bad bytes
                    raise Damage(f"an index that cannot be read: {error}") from error
        table = np.concatenate(columns) if columns else np.empty((0, 4), np.int64)
        table = table[np.lexsort((table[:, 1], table[:, 0]))]
        self._chunk, self._offset, self.log_time_ns, self.channel = np.ascontiguousarray(table.T)

    @classmethod
    def of(cls, path: Path) -> "MessageIndex | None":
        """Create that of the recording at `path` with its next parts; None if it has none, or a wrong one."""
        if not path.is_file():
            return None
        try:
            return cls(with_followers(path))
        except (Damage, OSError):
            return None

    def __len__(self) -> int:
        """Return the number of messages."""
        return len(self.channel)

    def _read_file(self, path: Path, stream: BinaryIO) -> NDArray[np.int64]:
        """Return rows of chunk, offset in it, log time and channel."""
        summary = make_reader(stream).get_summary()
        if summary is None or summary.statistics is None:
            raise Damage("no index")
        numbers = self._take_channels(summary)
        size = path.stat().st_size
        rows: list[NDArray[np.int64]] = []
        for chunk in sorted(summary.chunk_indexes, key=lambda chunk: chunk.chunk_start_offset):
            end = chunk.chunk_start_offset + chunk.chunk_length
            if chunk.chunk_length > LARGEST_RECORD_BYTES or end + chunk.message_index_length > size:
                raise Damage("an index of a chunk that is not there, or too large")
            stream.seek(end)
            entries = _entries(stream.read(chunk.message_index_length))
            for channel, found in entries:
                part = np.empty((len(found), 4), np.int64)
                part[:, 0], part[:, 1] = len(self._chunks), found["offset"]
                part[:, 2], part[:, 3] = found["log_time_ns"], numbers[channel]
                rows.append(part)
            self._chunks.append((path, chunk))
        if sum(map(len, rows)) != summary.statistics.message_count:
            raise Damage("an index that does not have all messages")
        return np.concatenate(rows) if rows else np.empty((0, 4), np.int64)

    def _take_channels(self, summary: FileIndex) -> dict[int, int]:
        numbers: dict[int, int] = {}
        for channel in summary.channels.values():
            schema, kind = summary.schemas.get(channel.schema_id), RecordingKind(channel.message_encoding)
            if schema is not None:
                text = schema.data.decode(errors=SCHEMA_ERRORS)
                kind = RecordingKind(channel.message_encoding, schema.name, schema.encoding, text)
            numbers[channel.id] = len(self.channels)
            self.channels.append((channel.topic, kind))
        return numbers

    def read(self, rows: NDArray[np.intp]) -> Iterator[tuple[int, Recorded]]:
        """Yield messages by their rows in ascending order; those in a damaged chunk are left out."""
        bounds = np.flatnonzero(np.diff(self._chunk[rows])) + 1
        open_file: tuple[Path, BinaryIO] | None = None
        try:
            for group in np.split(rows, bounds) if len(rows) else ():
                path, chunk = self._chunks[self._chunk[group[0]]]
                if open_file is None or open_file[0] != path:
                    if open_file is not None:
                        open_file[1].close()
                    open_file = path, path.open("rb")
                try:
                    body = _body(open_file[1], chunk)
                    yield from [(int(row), self._message(body, int(row))) for row in group]
                except (Damage, struct.error):
                    continue
        finally:
            if open_file is not None:
                open_file[1].close()

    def _message(self, body: bytes, row: int) -> Recorded:
        begin = int(self._offset[row])
        _, length = _RECORD_HEAD.unpack_from(body, begin)
        begin += _RECORD_HEAD.size
        _, sequence, log_time_ns, publish_time_ns = _MESSAGE_HEAD.unpack_from(body, begin)
        name, kind = self.channels[self.channel[row]]
        payload = body[begin + _MESSAGE_HEAD.size : begin + length]
        return Recorded(name, log_time_ns, publish_time_ns, sequence, payload, kind)


def _entries(records: bytes) -> Iterator[tuple[int, NDArray[np.void]]]:
    """Yield channel and entries of each message index among records."""
    at = 0
    while at < len(records):
        opcode, length = _RECORD_HEAD.unpack_from(records, at)
        at += _RECORD_HEAD.size
        if opcode == Opcode.MESSAGE_INDEX:
            channel, size = _INDEX_HEAD.unpack_from(records, at)
            yield channel, np.frombuffer(records, _ENTRY, size // _ENTRY.itemsize, at + _INDEX_HEAD.size)
        at += length


def _body(stream: BinaryIO, chunk: ChunkIndex) -> bytes:
    """Read and unpack a chunk.

    Raises:
        Damage: It cannot be read.
    """
    stream.seek(chunk.chunk_start_offset + _RECORD_HEAD.size)
    content = stream.read(max(chunk.chunk_length - _RECORD_HEAD.size, 0))
    try:
        found = Chunk.read(ReadDataStream(BytesIO(content)))
    except Exception as error:  # the library raises anything on bad bytes
        raise Damage("a chunk record that cannot be read") from error
    return unpacked(found)
