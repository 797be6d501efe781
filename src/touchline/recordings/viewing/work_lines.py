"""Ground that a tool has been over, as lines of its width, in messages that stay small however long it works.

Two markers show it: one has all but the latest lines and is sent seldom, the other has the latest and is sent every
second. The last message of each, which late joiners get and viewers look for when they jump to a time in a recording,
is thus always complete.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from touchline.recordings.viewing.body_frames import Stamp, seconds_between
from touchline.recordings.viewing.markers import Floats, LineList, lines_through, simplified
from touchline.schemas.messages import ColorRGBA

#: Largest distance of the lines from the tool's path.
_TOLERANCE_M: Final = 0.005
_PERIOD_S: Final = 1.0
#: Most latest lines: this number, or this share of all others.
_LATEST: Final = 64
_LATEST_SHARE: Final = 1 / 8
#: Points of a stroke that are simplified at once.
_MOST_POINTS: Final = 500
_PAINT: Final = ColorRGBA(r=1.0, g=1.0, b=1.0, a=0.95)
_ROLLED: Final = ColorRGBA(r=0.75, g=0.5, b=0.25, a=0.5)

_NONE: Final = np.zeros((0, 4))


class WorkLines:
    """Collector of the lines.

    Args:
        width_m: Width of the tool's strip.
        covers: Whether it covers areas rather than painting lines.
    """

    def __init__(self, width_m: float, *, covers: bool = False) -> None:
        self.width_m = width_m
        self._lists = [LineList(name, width_m, _ROLLED if covers else _PAINT) for name in ("work", "latest work")]
        self._older, self._latest = _NONE, _NONE
        self._stroke: list[Floats] = []
        self._waiting = 0
        self._changed = False
        self._sent_at: Stamp | None = None

    def add(self, points: Floats, *, goes_on: bool) -> None:
        """Add points (n, 2) of a stroke, the first of which is the last of those before if it ``goes_on``."""
        if not goes_on:
            self._end_stroke()
        elif self._stroke:
            points = points[1:]
        self._stroke.append(points)
        self._waiting += len(points)
        self._changed = self._changed or len(points) > 0
        if self._waiting > _MOST_POINTS:
            last = self._stroke[-1][-1:]
            self._end_stroke()
            self._stroke, self._waiting = [last], 1

    def _stroke_lines(self) -> Floats:
        return lines_through(simplified(np.vstack(self._stroke), _TOLERANCE_M)) if self._stroke else _NONE

    def _end_stroke(self) -> None:
        self._latest = np.vstack((self._latest, self._stroke_lines()))
        self._stroke, self._waiting = [], 0

    def due(self, now: Stamp) -> tuple[bytes | None, bytes | None]:
        """Return due messages: a MarkerArray of the older lines, and one of the latest."""
        if not self._changed or (self._sent_at is not None and seconds_between(self._sent_at, now) < _PERIOD_S):
            return None, None
        self._changed, self._sent_at = False, now
        older = None
        if len(self._latest) >= max(_LATEST, _LATEST_SHARE * len(self._older)):
            self._older, self._latest = np.vstack((self._older, self._latest)), _NONE
            older = self._lists[0].pack(self._older)
        return older, self._lists[1].pack(np.vstack((self._latest, self._stroke_lines())))

    def whole(self) -> tuple[bytes, bytes]:
        """Return both messages, whatever was sent before."""
        self._end_stroke()
        self._older, self._latest = np.vstack((self._older, self._latest)), _NONE
        return self._lists[0].pack(self._older), self._lists[1].pack(_NONE)

    def cleared(self) -> tuple[bytes, bytes]:
        """Return messages that remove both markers."""
        return self._lists[0].pack(_NONE), self._lists[1].pack(_NONE)
