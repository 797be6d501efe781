"""The attachment that every sample carries: rmw_zenoh's 33 bytes of sequence, source time and publisher."""

import struct
from typing import NamedTuple

_FORMAT = struct.Struct("<qqB16s")
_GID_BYTES = 16


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


def unpack(data: bytes) -> Attachment | None:
    """Unpack the attachment in ``data``; ``None`` if it is not one."""
    if len(data) != _FORMAT.size:
        return None
    sequence, source_time_ns, length, publisher = _FORMAT.unpack(data)
    if length != _GID_BYTES or sequence < 1:
        return None
    return Attachment(sequence, source_time_ns, publisher)
