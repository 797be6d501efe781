"""Attachment of every sample: rmw_zenoh's 33 bytes of sequence, source time and publisher, and a checksum.

Zenoh from 1.8 on may deliver a damaged payload: where a publisher cuts off a subscriber that takes nothing, a batch
that is half written stays so, and those behind it are written on the same connection. The last message that arrives by
it then ends in bytes of others, under its own key, attachment and length.
"""

import struct
import zlib
from typing import NamedTuple

_FORMAT = struct.Struct("<qqB16s")
_GID_BYTES = 16
_CHECKSUM = struct.Struct("<I")


class Attachment(NamedTuple):
    """Sequence number from 1, source time (ns since the epoch), and the publisher's 16-byte id."""

    sequence: int
    source_time_ns: int
    publisher: bytes


def session_publisher(session_id: str) -> bytes:
    """Return the publisher id that stands for a session; no more than one of its publishers of a key may have it."""
    return bytes.fromhex(session_id.rjust(2 * _GID_BYTES, "0"))


def pack(sequence: int, source_time_ns: int, publisher: bytes) -> bytes:
    """Pack the 33 bytes."""
    return _FORMAT.pack(sequence, source_time_ns, _GID_BYTES, publisher)


def seal(numbered: bytes, key_sum: int, payload: bytes) -> bytes:
    """Return an attachment with the checksum of itself, the key and the payload behind its 33 bytes.

    Args:
        numbered: The 33 bytes.
        key_sum: As of `checksum_of_key`.
        payload: CDR.
    """
    return numbered + _CHECKSUM.pack(zlib.crc32(payload, zlib.crc32(numbered, key_sum)))


def checksum_of_key(key: str) -> int:
    """Return the part of a checksum that is the same for all samples of a key."""
    return zlib.crc32(key.encode())


def is_intact(data: bytes, key_sum: int, payload: bytes) -> bool:
    """Return whether a sample is as it was sent; foreign attachments, which have no checksum, are taken for that."""
    if len(data) != _FORMAT.size + _CHECKSUM.size:
        return True
    return seal(data[: _FORMAT.size], key_sum, payload) == data


def unpack(data: bytes) -> Attachment | None:
    """Unpack the attachment in ``data``, with a checksum or without; ``None`` if it is not one."""
    if len(data) not in (_FORMAT.size, _FORMAT.size + _CHECKSUM.size):
        return None
    sequence, source_time_ns, length, publisher = _FORMAT.unpack_from(data)
    if length != _GID_BYTES or sequence < 1:
        return None
    return Attachment(sequence, source_time_ns, publisher)
