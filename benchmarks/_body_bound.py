"""Bound of what any painter of a body can paint of a line among outlines, by geometry of its own."""

import math
from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from benchmarks._true_paint import RASTER_M, Bools
from touchline.schemas.curves import Curve
from touchline.schemas.template import Polygon
from touchline.schemas.vehicles import Vehicle

Floats = NDArray[np.float64]


def out_of_reach(curve: Curve, things: Sequence[Polygon], vehicle: Vehicle, kept_m: float) -> Bools:
    """Return at which cells (n,) of a line's raster the body is nearer to a thing than a distance.

    Cells count at which it is so in both directions, with the nozzle in the middle of the cell.

    Args:
        curve: The line.
        things: The things.
        vehicle: The robot.
        kept_m: The distance; 0: the body touches something.
    """
    at_m = np.arange(0.0, curve.length_m, RASTER_M)
    x, y, heading, _ = curve.at(np.minimum(at_m + 0.5 * RASTER_M, curve.length_m))
    ground = shapely.union_all([shapely.Polygon(each.corners) for each in things])
    shapely.prepare(ground)
    found = np.ones(len(at_m), dtype=bool)
    for turned in (0.0, math.pi):
        bodies = shapely.polygons(_bodies(np.column_stack((x, y)), heading + turned, vehicle))
        found &= shapely.dwithin(bodies, ground, kept_m)
    return found


def _bodies(nozzle: Floats, heading: Floats, vehicle: Vehicle) -> Floats:
    """Outlines (n, corners, 2) of the body with its nozzle at places (n, 2), the nozzle being beside the axle."""
    body = np.array(vehicle.body.footprint_m) - vehicle.tool.point_m
    cos, sin = np.cos(heading)[:, None], np.sin(heading)[:, None]
    turned = np.stack((cos * body[:, 0] - sin * body[:, 1], sin * body[:, 0] + cos * body[:, 1]), axis=-1)
    placed: Floats = nozzle[:, None, :] + turned
    return placed


def ends_in(where: Bools) -> int:
    """Return the number of ends of runs of a raster that are not ends of the raster."""
    return int(np.count_nonzero(np.diff(where.astype(int))))
