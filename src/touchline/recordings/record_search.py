"""Search for records of an MCAP file without chunks after one that cannot be read."""

import re
import struct
from typing import BinaryIO

from mcap.opcode import Opcode

_HEAD = struct.Struct("<BQ")
#: Records that have to follow one another to be believed.
_IN_A_ROW = 3
#: Least size of a record's content, by opcode: its fixed fields and empty texts.
_FEWEST_BYTES = {
    Opcode.SCHEMA: 14,
    Opcode.CHANNEL: 16,
    Opcode.MESSAGE: 22,
    Opcode.ATTACHMENT: 36,
    Opcode.METADATA: 8,
    Opcode.DATA_END: 4,
}
_SIGHT = re.compile(
    b"[" + b"".join(re.escape(bytes((opcode,))) for opcode in _FEWEST_BYTES) + rb"](?=.{4}\x00{4})", re.DOTALL
)  # shorter than 4 GiB
_SEARCH_BYTES = 1024 * 1024


def next_record(stream: BinaryIO, begin: int, end: int) -> int | None:
    """Return the first byte from ``begin`` on where several valid records follow one another; None if there is none.

    Args:
        stream: The file; its position is changed.
        begin: Start of the search.
        end: The file's size.
    """
    for block_at in range(begin, end, _SEARCH_BYTES):
        stream.seek(block_at)
        block = stream.read(_SEARCH_BYTES + _HEAD.size)
        for sight in _SIGHT.finditer(block):
            at = block_at + sight.start()
            if sight.start() < _SEARCH_BYTES and _is_record(stream, at, end):
                return at
    return None


def _is_record(stream: BinaryIO, at: int, end: int) -> bool:
    """Return whether records follow one another from ``at`` on, to the end of the data or far enough."""
    for _ in range(_IN_A_ROW):
        stream.seek(at)
        head = stream.read(_HEAD.size)
        if len(head) < _HEAD.size:
            return False
        opcode, length = _HEAD.unpack(head)
        at += _HEAD.size + length
        if opcode not in _FEWEST_BYTES or length < _FEWEST_BYTES[opcode] or at > end:
            return False
        if opcode == Opcode.DATA_END:
            return bool(length == _FEWEST_BYTES[opcode])
    return True
