"""Obstacles that a robot sees, as lines for viewers: outlines coloured by kind, and arrows of motion."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from touchline.recordings.viewing.markers import Floats, LineList, lines_through
from touchline.schemas import topics
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages import ColorRGBA, Duration

_WIDTH_M: Final = 0.05
#: An arrow is as long as the way in this time; its head has this share of it and this angle.
_ARROW_S, _HEAD, _HEAD_RAD = 1.0, 0.3, 0.45
#: They vanish this long after the last message, five times the period of the topic.
_LIFETIME: Final = Duration(sec=1)

_KNOWN, _MISSING = (0.6, 0.6, 0.6, 0.9), (0.6, 0.6, 0.6, 0.3)
_THING: Final = (0.95, 0.9, 0.25, 0.9)
_OF_KIND: Final = {
    "person": (0.9, 0.38, 0.17, 0.9),
    "post": (0.8, 0.47, 0.65, 0.9),
    "wall": (0.34, 0.71, 0.91, 0.9),
}


class ObstacleLines:
    """Packer of the markers of `Obstacles`; validating messages as small as points would take milliseconds each."""

    def __init__(self) -> None:
        self._list = LineList("obstacles", _WIDTH_M, ColorRGBA(a=1.0), _LIFETIME)

    def pack(self, seen: Any) -> bytes:
        """Return a MarkerArray of all obstacles of a message, or of its fields.

        Raises:
            PayloadError: A number is not finite, or the coordinates of an outline are not pairs.
        """
        lines, colors = [np.zeros((0, 4))], [np.zeros((0, 4))]
        for each in seen.obstacles:
            lines.append(_lines(each))
            colors.append(np.tile(_color(each), (len(lines[-1]), 1)))
        drawn = np.concatenate(lines)
        if not np.isfinite(drawn).all():
            raise PayloadError(f"{topics.OBSTACLES.name}: a place or velocity is not finite")
        return self._list.pack(drawn, np.concatenate(colors))


def _color(seen: Any) -> tuple[float, float, float, float]:
    return _MISSING if seen.missing else _KNOWN if seen.known else _OF_KIND.get(seen.kind, _THING)


def _lines(seen: Any) -> Floats:
    """Lines (n, 4) of the outline, and of an arrow if it moves."""
    if len(seen.outline_x_m) != len(seen.outline_y_m):
        raise PayloadError(f"{topics.OBSTACLES.name}: outline_x_m and outline_y_m have different lengths")
    outline = np.column_stack((seen.outline_x_m, seen.outline_y_m))
    lines = lines_through(np.concatenate((outline, outline[:1])))
    if not seen.moving:
        return lines
    tail = np.array((seen.x_m, seen.y_m))
    way = _ARROW_S * np.array((seen.vx_mps, seen.vy_mps))
    head = tail + way
    cos, sin = math.cos(_HEAD_RAD), math.sin(_HEAD_RAD)
    barbs = [head - _HEAD * np.array(((cos, side * sin), (-side * sin, cos))) @ way for side in (1, -1)]
    return np.concatenate((lines, [(*tail, *head)], [(*head, *barb) for barb in barbs]))
