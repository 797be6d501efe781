"""Recordings as a bad disk, a bad program or a bad person leaves them, the same ones every time."""

import random
import struct
from collections.abc import Callable

from mcap.writer import MCAP0_MAGIC

_HEAD = struct.Struct("<BQ")


def records(data: bytes) -> list[tuple[int, int]]:
    """(start, end) of each top-level record, its head included."""
    places, at = [], len(MCAP0_MAGIC)
    while at + _HEAD.size <= len(data) - len(MCAP0_MAGIC):
        _, length = _HEAD.unpack_from(data, at)
        places.append((at, at + _HEAD.size + length))
        at = places[-1][1]
    return places


def _flip_bits(data: bytearray, choose: random.Random) -> None:
    for _ in range(choose.randint(1, 20)):
        data[choose.randrange(len(data))] ^= 1 << choose.randrange(8)


def _cut(data: bytearray, choose: random.Random) -> None:
    del data[choose.randrange(len(data)) :]


def _cut_out(data: bytearray, choose: random.Random) -> None:
    begin = choose.randrange(len(data))
    del data[begin : begin + choose.randint(1, 500)]


def _other_length(data: bytearray, choose: random.Random) -> None:
    start, end = choose.choice(records(data))
    lengths = (0, 1, end - start, end - start + 1, 2**31, 2**32 - 1, 2**63 - 1, 2**64 - 1)
    struct.pack_into("<Q", data, start + 1, choose.choice(lengths))


def _other_number(data: bytearray, choose: random.Random) -> None:
    """Over one of the first fields of a record: ids, times, counts, sizes."""
    start, end = choose.choice(records(data))
    at = start + _HEAD.size + choose.randrange(max(min(end - start - _HEAD.size, 60), 1))
    number = choose.choice((b"\xff" * 8, bytes(8), b"\x80" + bytes(7), b"\xff\xff\xff\x7f"))
    data[at : at + len(number)] = number


def _swap(data: bytearray, choose: random.Random) -> None:
    (a, b), (c, d) = sorted(choose.sample(records(data), 2))
    data[a:d] = data[c:d] + data[b:c] + data[a:b]


def _repeat(data: bytearray, choose: random.Random) -> None:
    a, b = choose.choice(records(data))
    data[a:a] = data[a:b] * choose.randint(1, 3)


def _other_opcode(data: bytearray, choose: random.Random) -> None:
    start, _ = choose.choice(records(data))
    data[start] = choose.randrange(256)


MUTATIONS: tuple[Callable[[bytearray, random.Random], None], ...] = (
    _flip_bits,
    _cut,
    _cut_out,
    _other_length,
    _other_number,
    _swap,
    _repeat,
    _other_opcode,
)


def mutated(original: bytes, number: int) -> bytes:
    """The ``number``-th mutation of a recording."""
    data = bytearray(original)
    MUTATIONS[number % len(MUTATIONS)](data, random.Random(number))
    return bytes(data)
