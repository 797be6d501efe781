"""Outline of a body at a pose."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import shapely


def placed(outline: Iterable[tuple[float, float]], pose: Sequence[float]) -> shapely.Polygon:
    """Return an outline at a pose.

    Args:
        outline: Corners in the body's own frame (m).
        pose: x (m), y (m), heading (rad), map frame.
    """
    import shapely

    x, y, heading = pose
    cos, sin = math.cos(heading), math.sin(heading)
    return shapely.Polygon([(x + cos * a - sin * b, y + sin * a + cos * b) for a, b in outline])
