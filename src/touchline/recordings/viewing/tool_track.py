"""Path of a tool over the ground, from the robot's poses."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from touchline.recordings.viewing.body_frames import PoseNumbers
from touchline.recordings.viewing.markers import Floats

_STEP_M: Final = 0.1
"""Shorter steps are ignored."""


class ToolTrack:
    """Collector of the tool's places.

    Args:
        point_m: The tool's place (x, y) in the body's frame.
    """

    def __init__(self, point_m: tuple[float, float]) -> None:
        self._point_m = point_m
        self._last: tuple[float, float] | None = None

    def moved(self, pose: PoseNumbers) -> Floats | None:
        """Return the last place and the present one (2, 2), m, if they are a step apart; else None."""
        x, y, _, qx, qy, qz, qw = pose
        heading = math.atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
        ahead, left = self._point_m
        now = (
            x + ahead * math.cos(heading) - left * math.sin(heading),
            y + ahead * math.sin(heading) + left * math.cos(heading),
        )
        before = self._last
        if before is not None and math.dist(before, now) < _STEP_M:
            return None
        self._last = now
        return None if before is None else np.array((before, now))
