"""Cells of robots that all report their positions at the same time, without a hub."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.cells import ROBOT_RADIUS_M, BufferedCell, keep_robots_apart, within_area
from touchline.coordination.free_area import FreeArea

Floats = NDArray[np.float64]


def stopping_segments(poses: Floats, deceleration_mps2: float) -> Floats:
    """Stopping segments of robots: from their positions v²/(2a) straight ahead.

    Args:
        poses: (n, 4) x, y (m), heading (rad) and speed (m/s, negative backward).
        deceleration_mps2: Deceleration a.

    Returns:
        (n, 4) x₁ y₁ x₂ y₂ (m).
    """
    here, heading, speed = poses[:, :2], poses[:, 2], poses[:, 3]
    braking_m = speed * np.abs(speed) / (2.0 * deceleration_mps2)
    return np.column_stack((here, here + braking_m[:, None] * np.column_stack((np.cos(heading), np.sin(heading)))))


def buffered_cells(
    segments: Floats, area: FreeArea, radius_m: float = ROBOT_RADIUS_M, names: Sequence[str] = ()
) -> list[BufferedCell]:
    """Compute the buffered cells of robots.

    Args:
        segments: (n, 4) x₁ y₁ x₂ y₂ of the stopping segments (m); a segment may be a point.
        area: Area of the team.
        radius_m: Safety radius r_s.
        names: Names of the robots for errors; by default their numbers.

    Raises:
        SegmentsMeet: Two segments touch or cross, or one touches a wall.
    """
    n = len(segments)
    rows = np.zeros((n, n + len(area.sides) + len(area.walls), 3))
    called = list(names) or [str(number) for number in range(n)]
    keep_robots_apart(segments, radius_m, rows, called)
    return within_area(segments, area, (radius_m, radius_m), rows, called)
