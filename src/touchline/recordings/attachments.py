"""Files attached to an MCAP recording: their descriptions and data."""

import struct
import zlib
from io import BytesIO
from pathlib import Path

from mcap.data_stream import ReadDataStream

from touchline.recordings.recorded import Attached, Damage

#: Longest head of an attachment: times, name, media type and size.
LONGEST_ATTACHMENT_HEAD_BYTES = 64 * 1024
_CRC = struct.Struct("<I")
_LARGEST_BYTES = 1024**3


def attachment_at(file: Path, begin: int, head: bytes, length: int) -> Attached:
    """Return the attachment whose record of ``length`` bytes begins at byte ``begin`` of ``file`` with ``head``.

    Args:
        file: The recording's file.
        begin: Where the record begins, bytes.
        head: The first bytes of the record, with all fields before the data.
        length: Length of the record, bytes.

    Raises:
        Damage: It is no attachment.
    """
    source = BytesIO(head)
    stream = ReadDataStream(source)
    try:
        log_time_ns, create_time_ns = stream.read8(), stream.read8()
        name, media_type = stream.read_prefixed_string(), stream.read_prefixed_string()
        size_bytes = stream.read8()
    except Exception as error:  # whatever the bytes lead the library into
        raise Damage("an attachment that cannot be read") from error
    if source.tell() + size_bytes + _CRC.size != length:
        raise Damage(f"the attachment {name!r} of another size than it says")
    return Attached(name, media_type, log_time_ns, create_time_ns, size_bytes, file, begin + source.tell())


def attached_data(attached: Attached) -> bytes:
    """Return the data of an attachment.

    Raises:
        Damage: Their checksum is wrong, or they are too large.
        OSError: The file cannot be read any more.
    """
    if attached.size_bytes > _LARGEST_BYTES:
        raise Damage(f"an attachment of {attached.size_bytes:,} bytes; at most {_LARGEST_BYTES:,} are read")
    with attached.file.open("rb") as stream:
        stream.seek(attached.at_byte)
        data = stream.read(attached.size_bytes)
        (checksum,) = _CRC.unpack(stream.read(_CRC.size))
        stream.seek(attached.at_byte - _head_bytes(attached))
        head = stream.read(_head_bytes(attached))
    if checksum and zlib.crc32(data, zlib.crc32(head)) != checksum:
        raise Damage(f"the attachment {attached.name!r}, whose checksum is wrong")
    return data


def _head_bytes(attached: Attached) -> int:
    """Return the length of the record before the data, bytes."""
    return 8 + 8 + 4 + len(attached.name.encode()) + 4 + len(attached.media_type.encode()) + 8
