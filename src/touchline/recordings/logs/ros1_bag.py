"""Reader of ROS 1 bags (format 2.0) from front to back, with limits on what a small file may unpack to.

It follows the order of the file and not of its index: that sorts by time, and so mixes up what was recorded before and
after a clock was set back. Bags that were cut off have no index, either.
"""

from __future__ import annotations

import bz2
import struct
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import BinaryIO, Final

from touchline.recordings.mcap_file import LARGEST_RATIO, LARGEST_RECORD_BYTES
from touchline.recordings.recorded import SCHEMA_ERRORS, Damage, Recorded, RecordingKind
from touchline.recordings.unpack import LARGEST_CHUNK_BYTES

BAG1_MAGIC: Final = b"#ROSBAG V2.0\n"
_MESSAGE, _CHUNK, _CONNECTION = b"\x02", b"\x05", b"\x07"
_LENGTH: Final = struct.Struct("<I")
_TIME: Final = struct.Struct("<II")
Fields = dict[bytes, bytes]


class Ros1Bag:
    """One bag.

    Args:
        path: Path of the file.
        stream: The open file, at its beginning.

    Attributes:
        problem: Why reading ended early; empty if it did not.

    Raises:
        Damage: It is no bag of that format.
    """

    def __init__(self, path: Path, stream: BinaryIO) -> None:
        self._stream = stream
        self._size_bytes = path.stat().st_size
        self._kinds: dict[bytes, tuple[str, RecordingKind]] = {}
        self._unpacked_bytes = 0
        self.problem = ""
        begin = stream.read(len(BAG1_MAGIC))
        if begin != BAG1_MAGIC:
            raise Damage(f"it begins with {begin!r}, not with {BAG1_MAGIC!r}")

    def messages(self, topics: Collection[str] | None) -> Iterator[Recorded]:
        """Yield the messages in the order of the file, of some topics only if given; see `problem` afterwards."""
        try:
            while (record := _read_record(self._stream)) is not None:
                fields, data = record
                if fields.get(b"op") == _CHUNK:
                    body = self._unpacked(fields, data)
                    for inner, content in _records_in(body):
                        yield from self._taken(inner, content, topics)
                else:
                    yield from self._taken(fields, data, topics)
        except Damage as damage:
            self.problem = f"{damage}, at byte {self._stream.tell():,} of {self._size_bytes:,}"

    def _taken(self, fields: Fields, data: bytes, topics: Collection[str] | None) -> Iterator[Recorded]:
        kind, connection = fields.get(b"op"), fields.get(b"conn", b"")
        if kind == _CONNECTION and connection not in self._kinds:
            self._kinds[connection] = _connection(fields, data)
        elif kind == _MESSAGE and connection in self._kinds and len(fields.get(b"time", b"")) == _TIME.size:
            topic, form = self._kinds[connection]
            if topics is None or topic in topics:
                seconds, nanoseconds = _TIME.unpack(fields[b"time"])
                time_ns = seconds * 1_000_000_000 + nanoseconds
                yield Recorded(topic, time_ns, time_ns, 0, data, form)

    def _unpacked(self, fields: Fields, data: bytes) -> bytes:
        compression = fields.get(b"compression", b"").decode("ascii", "replace")
        size = _LENGTH.unpack(fields[b"size"])[0] if len(fields.get(b"size", b"")) == _LENGTH.size else 0
        if size > LARGEST_CHUNK_BYTES:
            raise Damage(f"a chunk of {size:,} bytes; at most {LARGEST_CHUNK_BYTES:,} are unpacked")
        self._unpacked_bytes += size
        most = LARGEST_CHUNK_BYTES + LARGEST_RATIO * self._size_bytes
        if self._unpacked_bytes > most:
            raise Damage(f"chunks that hold more than {most:,} bytes, {LARGEST_RATIO} times what they take")
        try:
            body = _decompressed(compression, data, size + 1)
        except Damage:
            raise
        except Exception as error:  # each compressor raises its own kind
            raise Damage(f"a chunk that cannot be unpacked ({error})") from error
        if len(body) != size:
            raise Damage(f"a chunk that does not unpack to the {size:,} bytes that it claims")
        return body


def _decompressed(compression: str, data: bytes, most: int) -> bytes:
    """Unpack at most `most` bytes of the data."""
    if compression == "bz2":
        return bz2.BZ2Decompressor().decompress(data, max_length=most)
    if compression == "lz4":
        from lz4.frame import LZ4FrameDecompressor

        return bytes(LZ4FrameDecompressor().decompress(data, max_length=most))
    if compression == "none":
        return data
    raise Damage(f"a chunk of the unknown compression {compression!r}")


def _connection(fields: Fields, data: bytes) -> tuple[str, RecordingKind]:
    """Return topic and kind of a connection."""
    described = _fields(data)
    topic = fields.get(b"topic", b"").decode("utf-8", "replace")
    kind = described.get(b"type", b"").decode("utf-8", "replace")
    text = described.get(b"message_definition", b"").decode(errors=SCHEMA_ERRORS)
    return topic, RecordingKind("ros1", kind, "ros1msg", text)


def _read_record(stream: BinaryIO) -> tuple[Fields, bytes] | None:
    """Read header and data of the next record; None at the end of the file."""
    parts: list[bytes] = []
    for _ in range(2):
        head = stream.read(_LENGTH.size)
        if not head and not parts:
            return None
        length = _LENGTH.unpack(head)[0] if len(head) == _LENGTH.size else LARGEST_RECORD_BYTES + 1
        if len(head) == _LENGTH.size and length > LARGEST_RECORD_BYTES:
            raise Damage(f"a record of {length:,} bytes; at most {LARGEST_RECORD_BYTES:,} are read")
        content = stream.read(length) if len(head) == _LENGTH.size else b""
        if len(head) < _LENGTH.size or len(content) < length:
            raise Damage("a record that the end of the file cuts off")
        parts.append(content)
    return _fields(parts[0]), parts[1]


def _records_in(body: bytes) -> Iterator[tuple[Fields, bytes]]:
    """Yield header and data of each record in a chunk."""
    at = 0
    while at < len(body):
        head, at = _part(body, at)
        data, at = _part(body, at)
        yield _fields(head), data


def _part(body: bytes, at: int) -> tuple[bytes, int]:
    """Return the bytes behind a length field, and where they end."""
    begin = at + _LENGTH.size
    end = begin + (_LENGTH.unpack_from(body, at)[0] if begin <= len(body) else 0)
    if begin > len(body) or end > len(body):
        raise Damage("a record that goes on beyond its chunk")
    return body[begin:end], end


def _fields(header: bytes) -> Fields:
    """Parse the fields of a header by name."""
    found: Fields = {}
    at = 0
    while at < len(header):
        field, at = _part(header, at)
        name, _, value = field.partition(b"=")
        found[name] = value
    if not found:
        raise Damage("a record without a header")
    return found
