"""Zones of a robot's protection: outlines in which a thing stops it, or slows it down."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from touchline.schemas.messages.viewing_messages import PolygonStamped
from touchline.tui.raster import EMPTY, Polyline


@dataclass(frozen=True, eq=False)
class ZoneOutlines:
    """Outlines in the map frame; empty without a message.

    Attributes:
        stop: Within it a thing that the plan does not know stops the robot.
        slow: Within it such a thing slows it down.
    """

    stop: Polyline = EMPTY
    slow: Polyline = EMPTY


NO_ZONES = ZoneOutlines()


def closed_outline(message: PolygonStamped) -> Polyline:
    """Return the closed outline of a message.

    Raises:
        ValueError: A coordinate is not finite.
    """
    corners = [(point.x, point.y) for point in message.polygon.points]
    if not all(math.isfinite(number) for corner in corners for number in corner):
        raise ValueError("a corner of a zone is not finite")
    if not corners:
        return EMPTY
    x, y = np.array([*corners, corners[0]]).T
    return Polyline.of([(x, y)])
