"""Frames of NMEA, UBX and RTCM in one stream of bytes, each found by its own checksum.

After damage the search continues at the next byte, so that a wrong length costs no more than its own frame.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce
from operator import xor
from typing import Final, NamedTuple

import numpy as np

NMEA: Final = "nmea"
UBX: Final = "ubx"
RTCM: Final = "rtcm"
_LONGEST_SENTENCE = 1024
_UBX_HEAD: Final = b"\xb5\x62"
_CRC24: Final = 0x1864CFB


class Frame(NamedTuple):
    """Complete frame with a correct checksum."""

    protocol: str
    content: bytes


@dataclass
class FrameCounts:
    """Counts of skipped data.

    Attributes:
        bad_checksums: Frames with a wrong checksum.
        unchecked: Sentences without a checksum.
        cut: Frames cut off by the end of the log.
        foreign_bytes: Bytes that belong to no frame.
    """

    bad_checksums: int = 0
    unchecked: int = 0
    cut: int = 0
    foreign_bytes: int = 0


def frames(data: bytes, counts: FrameCounts, *, checked: bool = True) -> Iterator[Frame]:
    """Yield the frames of a stream, in order.

    Args:
        data: The stream.
        counts: Counts of skipped data, added to.
        checked: Whether sentences need a checksum; one that is there has to be right in any case. Those that lack it
            get it.
    """
    at, n = 0, len(data)
    while at < n:
        first = data[at]
        if first == 0x24:  # $
            size = _nmea(data, at, counts, checked=checked)
            protocol = NMEA
        elif first == 0xB5 and data.startswith(_UBX_HEAD, at):
            size, protocol = _ubx(data, at, counts), UBX
        elif first == 0xD3:
            size, protocol = _rtcm(data, at), RTCM
        else:
            size, protocol = 0, ""
        if size:
            content = data[at : at + size]
            yield Frame(protocol, _with_checksum(content) if protocol == NMEA and b"*" not in content else content)
            at += size
        else:
            counts.foreign_bytes += 1
            at += 1


def _with_checksum(sentence: bytes) -> bytes:
    body = sentence.rstrip(b"\r\n")
    return body + f"*{reduce(xor, body[1:], 0):02X}\r\n".encode()


def _nmea(data: bytes, at: int, counts: FrameCounts, *, checked: bool) -> int:
    """Return the length of a sentence that begins here; 0 if there is none."""
    end = data.find(b"\n", at, at + _LONGEST_SENTENCE)
    if end < 0:
        if len(data) - at < _LONGEST_SENTENCE and data[at + 1 : at + 3].isalpha():
            counts.cut += 1
        return 0
    line = data[at:end].rstrip(b"\r")
    star = line.rfind(b"*")
    if not line[1:6].isalnum() or b"$" in line[1:]:
        return 0
    if star < 0 and not checked:
        plausible = line[1:6].isupper() and line[6:7] == b"," and line.isascii() and line.decode().isprintable()
        counts.unchecked += plausible
        return end + 1 - at if plausible else 0
    try:
        checksum = int(line[star + 1 : star + 3], 16) if star > 0 else -1
    except ValueError:
        checksum = -1
    if checksum != reduce(xor, line[1 : star if star > 0 else len(line)], 0):
        counts.bad_checksums += 1
        return 0
    return end + 1 - at


def _ubx(data: bytes, at: int, counts: FrameCounts) -> int:
    """Return the length of a UBX frame that begins here; 0 if there is none (8-bit Fletcher checksum)."""
    if at + 8 > len(data):
        counts.cut += 1
        return 0
    size = 8 + int.from_bytes(data[at + 4 : at + 6], "little")
    if at + size > len(data):
        counts.cut += 1
        return 0
    checked = np.frombuffer(data, np.uint8, size - 4, at + 2).astype(np.uint64)
    a, b = int(checked.sum()) & 0xFF, int(checked @ np.arange(len(checked), 0, -1, dtype=np.uint64)) & 0xFF
    if (a, b) != (data[at + size - 2], data[at + size - 1]):
        counts.bad_checksums += 1
        return 0
    return size


def _rtcm(data: bytes, at: int) -> int:
    """Return the length of an RTCM 3 frame that begins here; 0 if there is none: 0xD3 is a common byte."""
    if at + 6 > len(data) or data[at + 1] & 0xFC:
        return 0
    size = 6 + (int.from_bytes(data[at + 1 : at + 3], "big") & 0x3FF)
    if at + size > len(data):
        return 0
    return size if _crc24q(data[at : at + size - 3]) == int.from_bytes(data[at + size - 3 : at + size], "big") else 0


def _crc24q(data: bytes) -> int:
    crc = 0
    for byte in data:
        crc = ((crc << 8) & 0xFFFFFF) ^ _TABLE[(crc >> 16) ^ byte]
    return crc


def _crc_entry(byte: int) -> int:
    crc = byte << 16
    for _ in range(8):
        crc <<= 1
        if crc & 0x1000000:
            crc ^= _CRC24
    return crc


_TABLE: Final = tuple(map(_crc_entry, range(256)))
