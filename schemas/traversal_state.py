"""Reads the traversal's state out of the CDR of a `traversal/status`, which may be kilobytes, and nothing else."""

import struct
from typing import Final

_TEXT_LENGTH: Final = struct.Struct("<I")
#: After the head of the CDR, and the seconds and nanoseconds of the stamp, comes the frame's name.
_FRAME_AT: Final = 4 + 8


def traversal_state(payload: bytes) -> int:
    """The state, as in `TraversalStatus`, of a payload that is well formed."""
    length: int = _TEXT_LENGTH.unpack_from(payload, _FRAME_AT)[0]
    return payload[_FRAME_AT + _TEXT_LENGTH.size + length]
