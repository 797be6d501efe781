"""Everything painted in this traversal, put together again from the batches in which it was told."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from touchline.schemas import messages as m
from touchline.schemas.cdr import decode, encode

_LINKED_AT_ONCE = 64


@dataclass
class _Stroke:
    """Batches that follow on one another; neighbours share their end points."""

    first: m.PaintMarks
    x_m: list[NDArray[np.float64]]
    y_m: list[NDArray[np.float64]]
    next_index: int

    def takes(self, marks: m.PaintMarks) -> bool:
        same = marks.segment_id == self.first.segment_id and marks.width_m == self.first.width_m
        return same and marks.first_index == self.next_index

    def append(self, marks: m.PaintMarks) -> None:
        self.x_m.append(marks.x_m[1:])
        self.y_m.append(marks.y_m[1:])
        self.next_index += len(marks.x_m) - 1

    def whole(self) -> m.PaintMarks:
        return self.first.model_copy(update={"x_m": np.concatenate(self.x_m), "y_m": np.concatenate(self.y_m)})


@dataclass
class PaintHistory:
    """Batches of `truth/paint` as they come; `link` puts them together a few at a time."""

    _unread: list[bytes] = field(default_factory=list)
    _strokes: list[_Stroke] = field(default_factory=list)
    _answer: bytes | None = None

    def clear(self) -> None:
        """A new traversal begins."""
        self._unread, self._strokes, self._answer = [], [], None

    def add(self, payload: bytes) -> None:
        """Take a message of `truth/paint`."""
        self._unread.append(payload)
        self._answer = None

    def link(self, most: int = _LINKED_AT_ONCE) -> bool:
        """Put some batches together; returns whether more are left."""
        for payload in self._unread[:most]:
            marks = decode(m.PaintMarks, payload)
            if self._strokes and self._strokes[-1].takes(marks):
                self._strokes[-1].append(marks)
            else:
                end = marks.first_index + len(marks.x_m) - 1
                self._strokes.append(_Stroke(marks, [marks.x_m], [marks.y_m], end))
        del self._unread[:most]
        return bool(self._unread)

    def strokes(self) -> tuple[m.PaintMarks, ...]:
        """Every stroke, whole."""
        while self.link():
            pass
        return tuple(stroke.whole() for stroke in self._strokes)

    def answer(self) -> bytes:
        """CDR of the response to `truth/get_paint`."""
        if self._answer is None:
            self._answer = encode(m.GetPaintResponse(strokes=self.strokes()))
        return self._answer
