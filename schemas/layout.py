"""Fast packing of messages whose size never changes.

The robot sends hundreds of messages per simulated second. A message whose strings are constant and whose sequences
have a constant length is a fixed pattern of bytes with numbers in it, so packing one is a few ``struct`` calls.
"""

import struct
from collections.abc import Mapping, Sequence
from itertools import accumulate, pairwise
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.cdr import NUMPY_CODES, flat_fields
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages.base import Message

_HEADER = b"\x00\x01\x00\x00"
_LAID_OUT = frozenset({"size", "leaves", "_codes", "_head", "_pieces", "_runs", "_template"})


class FixedLayout:
    """The byte pattern of one message type with given constants.

    Args:
        kind: Message type without arrays of messages.
        strings: Constant of each string field, by dotted path; a tuple for a sequence of strings. Missing: empty.
        lengths: Length of each numeric sequence, by dotted path. Missing: 0.

    It is laid out when first used: that takes the definitions of all types, which few processes need.

    Attributes:
        size: Payload length in bytes.
        leaves: Dotted path of each number, in the order of :meth:`pack`; elements of arrays as ``path[i]``.
    """

    size: int
    leaves: list[str]

    def __init__(
        self,
        kind: type[Message],
        strings: Mapping[str, str | tuple[str, ...]] | None = None,
        lengths: Mapping[str, int] | None = None,
    ) -> None:
        self.kind = kind
        self._constants: tuple[Mapping[str, Any], Mapping[str, Any]] = strings or {}, lengths or {}

    def __getattr__(self, name: str) -> Any:
        """An attribute before anything is laid out."""
        if name not in _LAID_OUT:
            raise AttributeError(name)
        self._lay_out()
        return getattr(self, name)

    def _lay_out(self) -> None:
        kind, (strings, lengths) = self.kind, map(dict, self._constants)
        self.leaves = []
        self._body = bytearray()
        self._codes: list[tuple[int, str]] = []
        for path, primitive, count in flat_fields(kind.ros_type):
            if primitive == "string":
                self._place_strings(strings.pop(path, "" if count is None else ()))
            elif count is None:
                self._place_number(path, NUMPY_CODES[primitive])
            else:
                length = count
                if count < 0:
                    length = lengths.pop(path, 0)
                    self._place_constant(struct.pack("<I", length), 4)
                for index in range(length):
                    self._place_number(f"{path}[{index}]", NUMPY_CODES[primitive])
        if strings or lengths:
            raise KeyError(f"{kind.ros_type} has no field {', '.join([*strings, *lengths])}")
        self._template = bytes(_HEADER + self._body)
        self.size = len(self._template)
        self._runs = self._contiguous_runs()
        begins = [*(offset for _, offset, _, _ in self._runs), self.size]
        self._head = self._template[: begins[0]]
        self._pieces = [
            (packer.pack, slice(first, stop), self._template[offset + packer.size : begin])
            for (packer, offset, first, stop), begin in zip(self._runs, begins[1:], strict=True)
        ]

    def _align(self, size: int) -> None:
        self._body += bytes(-len(self._body) % size)

    def _place_constant(self, data: bytes, alignment: int) -> None:
        self._align(alignment)
        self._body += data

    def _place_strings(self, value: str | tuple[str, ...]) -> None:
        if isinstance(value, tuple):
            self._place_constant(struct.pack("<I", len(value)), 4)
        for text in value if isinstance(value, tuple) else (value,):
            data = text.encode() + b"\0"
            self._place_constant(struct.pack("<I", len(data)) + data, 4)

    def _place_number(self, path: str, code: str) -> None:
        size = struct.calcsize(code)
        self._align(size)
        self._codes.append((len(_HEADER) + len(self._body), code))
        self._body += bytes(size)
        self.leaves.append(path)

    def _contiguous_runs(self) -> list[tuple[struct.Struct, int, int, int]]:
        """Group neighbouring numbers, so that few ``struct`` calls pack them all: (struct, offset, first, stop)."""
        runs: list[tuple[str, int, int]] = []
        end = -1
        for index, (offset, code) in enumerate(self._codes):
            constant_between = end < 0 or any(self._template[end:offset])  # zero bytes between numbers are padding
            if not constant_between and offset - end < 8:
                formats, first, start = runs[-1]
                runs[-1] = (f"{formats}{offset - end}x{code}" if offset > end else formats + code, first, start)
            else:
                runs.append((f"<{code}", offset, index))
            end = offset + struct.calcsize(code)
        stops = [*(start for _, _, start in runs), len(self._codes)][1:]
        return [
            (struct.Struct(formats), offset, start, stop)
            for (formats, offset, start), stop in zip(runs, stops, strict=True)
        ]

    def place(self, path: str, count: int) -> tuple[int, np.dtype[Any]]:
        """Byte offset and type of `count` consecutive numbers of one type.

        Raises:
            KeyError: There is no such number.
            ValueError: They do not follow one another.
        """
        if path not in self.leaves:
            raise KeyError(f"{self.kind.ros_type} has no number {path}")
        first = self.leaves.index(path)
        offset, code = self._codes[first]
        kind = np.dtype(f"<{code}")
        expected = [(offset + index * kind.itemsize, code) for index in range(count)]
        if self._codes[first : first + count] != expected:
            raise ValueError(f"{self.kind.ros_type}: {count} numbers do not follow one another from {path} on")
        return offset, kind

    def columns(self, payloads: "Payloads", places: Mapping[str, int]) -> list[NDArray[Any]]:
        """Some numbers of many payloads: of each place an array (n, count).

        Args:
            payloads: n of them.
            places: Path of the first number of each, and how many follow on it without a gap.

        Raises:
            PayloadError: A payload is not of this layout: its length or a constant in it differs.
        """
        n = len(payloads.sizes)
        if payloads.sizes != [self.size] * n:
            raise PayloadError(f"{self.kind.ros_type}: not all are of the {self.size} bytes that are expected")
        table = np.frombuffer(payloads.data, np.uint8).reshape(n, self.size)
        constant = np.ones(self.size, np.bool_)
        for offset, code in self._codes:
            constant[offset : offset + struct.calcsize(code)] = False
        at = np.flatnonzero(constant)
        if (table[:, at] != np.frombuffer(self._template, np.uint8)[at]).any():
            raise PayloadError(f"{self.kind.ros_type}: other frame or names than expected")
        found = []
        for path, count in places.items():
            offset, kind = self.place(path, count)
            found.append(np.ascontiguousarray(table[:, offset : offset + count * kind.itemsize]).view(kind))
        return found

    def pack(self, *values: float) -> bytes:
        """The payload with ``values`` as its numbers, in the order of :attr:`leaves`."""
        pieces = [self._head]
        for pack, part, constant in self._pieces:
            pieces += pack(*values[part]), constant
        return b"".join(pieces)

    def unpack(self, payload: bytes) -> tuple[float, ...]:
        """The numbers of ``payload``, in the order of :attr:`leaves`.

        Raises:
            PayloadError: The payload is not of this layout: its length or a constant in it differs.
        """
        if len(payload) != self.size:
            raise PayloadError(f"{self.kind.ros_type}: {len(payload)} bytes where {self.size} are expected")
        numbers: list[float] = []
        for packer, offset, _, _ in self._runs:
            numbers += packer.unpack_from(payload, offset)
        if self.pack(*numbers) != payload:
            raise PayloadError(f"{self.kind.ros_type}: other frame or names than expected")
        return tuple(numbers)


class Payloads(NamedTuple):
    """Payloads of one topic: the size of each, and all of them one after another."""

    sizes: list[int]
    data: bytes

    @classmethod
    def of(cls, payloads: list[bytes]) -> Self:
        """These."""
        return cls([len(payload) for payload in payloads], b"".join(payloads))

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """All of these, one part after another."""
        return cls([size for part in parts for size in part.sizes], b"".join(part.data for part in parts))

    def each(self) -> list[bytes]:
        """One by one."""
        return [self.data[begin:end] for begin, end in pairwise(accumulate(self.sizes, initial=0))]


class Records:
    """Packs many messages of one layout at once: some numbers from columns, all others as in a sample message.

    Args:
        layout: Of each message.
        sample: A payload of it, from which all that is not in a column is taken.
        columns: Path of the first number of each column, and how many follow on it without a gap.
        most: Messages that can be packed at once.
    """

    def __init__(self, layout: FixedLayout, sample: bytes, columns: Mapping[str, int], most: int) -> None:
        self._size = layout.size
        self._bytes = np.tile(np.frombuffer(sample, dtype=np.uint8), (most, 1))
        self._fields = [self._field(layout, path, count) for path, count in columns.items()]

    def _field(self, layout: FixedLayout, path: str, count: int) -> NDArray[Any]:
        offset, kind = layout.place(path, count)
        return np.ndarray((len(self._bytes), count), kind, self._bytes, offset, (self._size, kind.itemsize))

    def pack(self, *columns: NDArray[Any]) -> Payloads:
        """The payloads of n messages: of each column (n, count) values."""
        n = len(columns[0])
        for field, values in zip(self._fields, columns, strict=True):
            field[:n] = values
        return Payloads([self._size] * n, self._bytes[:n].tobytes())
