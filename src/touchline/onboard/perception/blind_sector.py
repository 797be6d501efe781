"""Blind sector: directions that none of a robot's lidars sees."""

from __future__ import annotations

import math
from collections.abc import Sequence

from touchline.schemas.vehicles import LidarSpec


def blind_sector_rad(lidars: Sequence[LidarSpec]) -> float:
    """Return the angle [rad] of all directions that no lidar sees; a gap of one beam between its ends counts as seen.

    Args:
        lidars: Lidars of a robot, taken to be at its middle.
    """
    fields = []
    for lidar in lidars:
        width = min((lidar.beams - 1) * lidar.step_rad + lidar.step_rad, math.tau)
        begin = lidar.first_rad % math.tau
        fields += [(begin, min(begin + width, math.tau)), (0.0, begin + width - math.tau)]
    seen = reached = 0.0
    for begin, end in sorted(fields):
        seen += max(end - max(begin, reached), 0.0)
        reached = max(reached, end)
    blind = math.tau - seen
    return blind if blind > 1e-6 else 0.0
