"""Zones: ground round a robot in which a thing that may move stops it, or slows it down."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.robust_overlay import as_area, union
from touchline.onboard.computer_state import ComputerState
from touchline.onboard.protection.way import NOT_LAID, measure_zones

if TYPE_CHECKING:
    import shapely

Floats = NDArray[np.float64]

POSES: Final = 8
"""Largest number of poses along the way of which an outline is made."""
SIMPLER_M: Final = 0.01
"""Rounding of outlines."""
_QUARTER_SEGMENTS: Final = 4


class ProtectionZones(NamedTuple):
    """Outlines (n, 2) [m], map frame.

    Attributes:
        stop_m: Within it a thing that the plan does not know stops the robot, unless its way leads away from there.
        slow_m: Within it, such a thing makes it drive more slowly than it does.
    """

    stop_m: Floats
    slow_m: Floats


def zones_of(computer: ComputerState, body: Floats) -> ProtectionZones | None:
    """Return the zones as of the last tick; None without a way to come.

    Args:
        computer: State of the computer, with the way and the hits of the last scan.
        body: (k, 2) outline of the body in its own frame [m].
    """
    import shapely

    way = computer.way
    if way.kind == NOT_LAID:
        return None
    slow_m: Floats = np.zeros(len(way.ahead_m))
    stop_m = float(measure_zones(computer.array, slow_m))
    poses = np.flatnonzero(slow_m)
    if not len(poses):
        return None
    poses = poses[np.unique(np.linspace(0, len(poses) - 1, POSES).astype(int))]
    cos, sin = np.cos(way.heading_rad[poses])[:, None], np.sin(way.heading_rad[poses])[:, None]
    x = way.east_m[poses, None] + cos * body[:, 0] - sin * body[:, 1]
    y = way.north_m[poses, None] + sin * body[:, 0] + cos * body[:, 1]
    bodies = [shapely.Polygon(corners) for corners in np.stack((x, y), axis=-1)]
    slow = union(shapely.buffer(bodies, slow_m[poses], quad_segs=_QUARTER_SEGMENTS))
    stop = shapely.buffer(bodies[0], stop_m, quad_segs=_QUARTER_SEGMENTS)
    return ProtectionZones(*(_outline(as_area(shape)) for shape in (stop, slow)))


def _outline(shape: shapely.Polygon | shapely.MultiPolygon) -> Floats:
    """Outer outline, of the largest part if there are several."""
    import shapely

    main = max(shapely.get_parts(shape), key=lambda part: float(part.area))
    corners: Floats = shapely.get_coordinates(shapely.simplify(main.exterior, SIMPLER_M))[:-1]
    return corners
