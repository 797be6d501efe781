"""Walls that no plan knows."""

import math
from itertools import pairwise
from typing import Any


def wall(*points: tuple[float, float]) -> list[dict[str, Any]]:
    """Walls of 10 cm from point to point."""
    walls = []
    for (ax, ay), (bx, by) in pairwise(points):
        length, heading = math.hypot(bx - ax, by - ay), math.atan2(by - ay, bx - ax)
        x, y = 0.5 * length, 0.05
        outline = [[-x, -y], [x, -y], [x, y], [-x, y]]
        middle = {"x_m": 0.5 * (ax + bx), "y_m": 0.5 * (ay + by), "heading_rad": heading}
        walls.append({"kind": "wall", **middle, "outline": outline})
    return walls
