"""Obstacles that a robot sees, as marks and outlines of the map."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from touchline.schemas.messages.obstacle_messages import Obstacle, Obstacles
from touchline.tui.raster import EMPTY, Polyline

KIND_MARKS: Final = {"person": "P", "post": "I", "wall": "W"}
THING_MARK: Final = "T"
ABSENT_MARK: Final = "?"
"""Mark of an obstacle of the plan whose place the robot sees to be free."""


@dataclass(frozen=True, eq=False)
class ObstacleView:
    """Obstacle that the plan does not know, or one of the plan that is missing.

    Attributes:
        mark: Character for its kind.
        x_m, y_m: Place in the map frame.
        motion_rad: Direction in which it moves; None: it stands.
        absent: Whether it is one of the plan that is missing.
        outline: Outline of one that the plan does not know.
    """

    mark: str
    x_m: float
    y_m: float
    motion_rad: float | None
    absent: bool
    outline: Polyline


def obstacle_views(message: Obstacles) -> tuple[ObstacleView, ...]:
    """Create the views of a message; obstacles of the plan that are where they should be have none.

    Raises:
        ValueError: A number is not finite, or the coordinates of an outline are not pairs.
    """
    return tuple(_view(each) for each in message.obstacles if each.missing or not each.known)


def _view(seen: Obstacle) -> ObstacleView:
    if not all(map(math.isfinite, (seen.x_m, seen.y_m, seen.vx_mps, seen.vy_mps))):
        raise ValueError(f"place or velocity of obstacle {seen.id} is not finite")
    if len(seen.outline_x_m) != len(seen.outline_y_m):
        raise ValueError(f"outline_x_m and outline_y_m of obstacle {seen.id} have different lengths")
    motion_rad = math.atan2(seen.vy_mps, seen.vx_mps) if seen.moving else None
    if seen.missing:
        return ObstacleView(ABSENT_MARK, seen.x_m, seen.y_m, None, absent=True, outline=EMPTY)
    mark = KIND_MARKS.get(seen.kind, THING_MARK)
    return ObstacleView(mark, seen.x_m, seen.y_m, motion_rad, absent=False, outline=_closed(seen))


def _closed(seen: Obstacle) -> Polyline:
    x, y = seen.outline_x_m, seen.outline_y_m
    return Polyline.of([(np.append(x, x[:1]), np.append(y, y[:1]))])
