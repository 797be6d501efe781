"""Messages of one size as arrays, without decoding them one by one.

In CDR the place of a number depends only on the lengths of the texts and lists before it. Where these are the same in
all messages of a topic, as they are for most sensors, all messages together are a table of bytes, and every field is a
column of it.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from touchline.recordings.decoding import layout
from touchline.recordings.message_table import MessageTable
from touchline.schemas.cdr import NUMPY_CODES

_HEAD_BYTES: Final = 4
_LITTLE_ENDIAN_CDR: Final = b"\0\1"
_COUNT: Final = np.dtype("<u4")
_TEXT: Final = "string"
_MOST_FIELDS: Final = 10_000


class _VariesError(ValueError):
    """Messages differ in more than their numbers, or have lists of messages."""


class _Columns:
    """Fields of messages of one size, placed one after the other.

    Args:
        raw: (n, bytes) payloads.
    """

    def __init__(self, raw: NDArray[np.uint8]) -> None:
        self._raw, self._at = raw, _HEAD_BYTES
        self.names: list[str] = []
        self.formats: list[np.dtype[np.void] | str | tuple[str, int]] = []
        self.offsets: list[int] = []

    def place(self, path: str, form: str) -> None:
        """Place a field of `layout`.

        Raises:
            _VariesError: Its place is not the same in all messages.
        """
        name, bracket, rest = path.partition("[")
        if not bracket:
            self._put(name, form, None)
            return
        if rest.count("]") != 1 or not rest.endswith("]"):
            raise _VariesError
        count = int(rest[:-1]) if rest != "]" else self._count()
        if form == _TEXT:
            for number in range(count):
                self._put(f"{name}[{number}]", form, None)
        else:
            self._put(name, form, count)

    def _put(self, name: str, form: str, count: int | None) -> None:
        if len(self.names) == _MOST_FIELDS:
            raise _VariesError
        if form == _TEXT:
            size, code = self._count(), "S"
            self._add(name, f"{code}{max(size - 1, 0)}", size)
            return
        if form not in NUMPY_CODES:
            raise _VariesError
        code = f"<{NUMPY_CODES[form]}"
        number = np.dtype(code).itemsize
        if count != 0:  # an empty list has nothing that is aligned
            self._align(number)
        self._add(name, code if count is None else (code, count), number * (1 if count is None else count))

    def _add(self, name: str, form: str | tuple[str, int], size: int) -> None:
        if self._at + size > self._raw.shape[1]:
            raise _VariesError
        self.names.append(name)
        self.formats.append(form)
        self.offsets.append(self._at)
        self._at += size

    def _align(self, size: int) -> None:
        self._at += -(self._at - _HEAD_BYTES) % size

    def _count(self) -> int:
        """Read a length that is the same in all messages."""
        self._align(_COUNT.itemsize)
        end = self._at + _COUNT.itemsize
        if end > self._raw.shape[1]:
            raise _VariesError
        counts = np.ascontiguousarray(self._raw[:, self._at : end]).view(_COUNT)
        if (counts != counts[0]).any():
            raise _VariesError
        self._at = end
        return int(counts[0, 0])


def fixed_columns(table: MessageTable) -> NDArray[np.void] | None:
    """View of a topic's messages as a structured array, a field for each of theirs; texts as bytes.

    Args:
        table: The messages.

    Returns:
        (n,) read-only view of the payloads; None if the messages differ in more than their numbers.
    """
    fields, sizes = layout(table.kind), set(table.payloads.sizes)
    if fields is None or table.kind.encoding != "cdr" or len(sizes) != 1:
        return None
    raw = np.frombuffer(table.payloads.data, np.uint8).reshape(len(table.payloads.sizes), sizes.pop())
    if raw.shape[1] < _HEAD_BYTES or (raw[:, :2] != np.frombuffer(_LITTLE_ENDIAN_CDR, np.uint8)).any():
        return None
    columns = _Columns(raw)
    try:
        for path, form in fields.items():
            columns.place(path, form)
    except _VariesError:
        return None
    places: Any = {"names": columns.names, "formats": columns.formats, "offsets": columns.offsets}
    places["itemsize"] = raw.shape[1]
    return np.frombuffer(table.payloads.data, np.dtype(places))
