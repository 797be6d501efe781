"""Painted strokes as a polyline that grows without copying, and detection of missed batches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.messages.touchline import PaintMarks
from touchline.tui.raster import Polyline

SAME_POINT_M = 1e-6
THINNING = 10
"""Ratio of received to kept points: the robot sends about one per centimetre, the eye needs one per decimetre."""


class PaintTrack:
    """Strokes of paint, assembled from numbered batches.

    A batch that does not continue the last one means that something was missed or that the robot started a new session:
    from then on batches wait until the whole list of strokes has been fetched.
    """

    def __init__(self) -> None:
        """Create an empty track, with the list of strokes yet to be fetched."""
        self._x: NDArray[np.float64] = np.empty(1024)
        self._y: NDArray[np.float64] = np.empty(1024)
        self._joined: NDArray[np.bool_] = np.empty(1024, dtype=np.bool_)
        self._count = 0
        self._next_index = self._kept = 0
        self._waiting: list[PaintMarks] = []
        self.revision = 0
        self.needs_fetch = False
        self._asked = self._void = False

    def __len__(self) -> int:
        return self._count

    @property
    def line(self) -> Polyline:
        """Polyline of all paint; views of the buffers, valid until the next change."""
        n = self._count
        return Polyline(self._x[:n], self._y[:n], self._joined[:n])

    def clear(self) -> None:
        """Drop all paint, also that of an answer under way."""
        self._void |= self._asked
        self._kept = 0
        self._restart()

    def begin_drive(self, *, same_job: bool) -> None:
        """Begin another drive, whose list of strokes has only its own; of the same job the paint so far is kept."""
        self._void |= self._asked
        self._kept, self._next_index = self._count if same_job else 0, 0
        self._waiting.clear()

    def _restart(self) -> None:
        """Drop all paint of this drive."""
        self._count, self._next_index = self._kept, 0
        self._waiting.clear()
        self.needs_fetch = False
        self.revision += 1

    def request_fetch(self) -> None:
        """Hold batches back until the list of strokes has been fetched."""
        self.needs_fetch = True

    def fetch_asked(self) -> None:
        """Note that the list of strokes is being fetched."""
        self._asked = True

    def fetched(self, strokes: Sequence[PaintMarks] | None) -> None:
        """Take the list of strokes, or None; one that was requested before `clear` is ignored."""
        void, self._asked, self._void = self._void, False, False
        if strokes is not None and not void:
            self.restore(strokes)

    def add(self, marks: PaintMarks) -> None:
        """Add a batch from the topic."""
        if not self.needs_fetch and not self._follows(marks):
            self.needs_fetch = True
        if self.needs_fetch:
            self._waiting.append(marks)
        else:
            self._append(marks.first_index, marks.x_m, marks.y_m)

    def restore(self, strokes: Sequence[PaintMarks]) -> None:
        """Replace this drive's paint by the fetched strokes, then add newer parts of batches that came meanwhile."""
        waiting = self._waiting[:]
        self._restart()
        for stroke in strokes:
            self._append(stroke.first_index, stroke.x_m, stroke.y_m)
        for marks in waiting:
            known = max(self._next_index - 1 - marks.first_index, 0)
            if marks.first_index + len(marks.x_m) > self._next_index:
                self.add(marks.model_copy(update=_rest(marks, known)) if known else marks)

    def _follows(self, marks: PaintMarks) -> bool:
        """True if a batch begins a stroke right after the last point, or continues from that point."""
        if marks.first_index == self._next_index:
            return True
        if marks.first_index != self._next_index - 1 or not len(marks.x_m):
            return False
        here = self._count - 1
        return bool(
            abs(marks.x_m[0] - self._x[here]) < SAME_POINT_M and abs(marks.y_m[0] - self._y[here]) < SAME_POINT_M
        )

    def _append(self, first_index: int, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> None:
        length = min(len(x_m), len(y_m))
        if not length:
            return
        goes_on = first_index == self._next_index - 1
        keep = np.arange(THINNING if goes_on else 0, length, THINNING)
        if not len(keep) or keep[-1] != length - 1:
            keep = np.append(keep, length - 1)
        end = self._count + len(keep)
        self._reserve(end)
        here = slice(self._count, end)
        self._x[here], self._y[here] = x_m[keep], y_m[keep]
        self._joined[here] = True
        self._joined[self._count] = goes_on
        self._count = end
        self._next_index = first_index + length

    def _reserve(self, size: int) -> None:
        if size <= len(self._x):
            return
        room = max(size, 2 * len(self._x))
        self._x = np.concatenate((self._x[: self._count], np.empty(room - self._count)))
        self._y = np.concatenate((self._y[: self._count], np.empty(room - self._count)))
        self._joined = np.concatenate((self._joined[: self._count], np.empty(room - self._count, dtype=np.bool_)))


def _rest(marks: PaintMarks, known: int) -> dict[str, object]:
    """Fields of a batch without its first points."""
    return {"first_index": marks.first_index + known, "x_m": marks.x_m[known:], "y_m": marks.y_m[known:]}
