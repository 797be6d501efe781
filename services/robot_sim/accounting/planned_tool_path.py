"""Planned path of the tool."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.messages import LinearDirection, Trajectory
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.paint.ledger import PaintStroke
from touchline.services.robot_sim.paint.paint_areas import polyline_of
from touchline.services.robot_sim.paint.targets import SHORTEST_M, nozzle_curve, segment_length_m

_SAME_PLACE_M: Final = 1e-3

Floats = NDArray[np.float64]


def planned_tool_path(trajectory: Trajectory, vehicle: Vehicle) -> list[PaintStroke]:
    """Return the tool's path along a trajectory, in stretches of one direction of travel; chords for arcs.

    Args:
        trajectory: The trajectory.
        vehicle: Vehicle with the tool.

    Raises:
        ValueError: A segment is neither a line nor an arc.
    """
    stretches: list[list[Floats]] = []
    direction = LinearDirection.NONE
    for segment in trajectory.path.segments:
        length_m = segment_length_m(segment)
        if length_m <= SHORTEST_M:
            continue
        points = polyline_of(nozzle_curve(segment, 0.0, length_m, vehicle))
        goes_on = bool(stretches) and segment.direction.value == direction
        if goes_on and math.dist(stretches[-1][-1][-1], points[0]) <= _SAME_PLACE_M:
            stretches[-1].append(points[1:])
        else:
            stretches.append([points])
        direction = segment.direction.value
    return [PaintStroke(np.concatenate(parts), vehicle.tool.width_m) for parts in stretches]


def off_path_m(strokes: list[PaintStroke], path: list[PaintStroke]) -> Floats:
    """Compute (n,) distances of the points of strokes from the nearest part of a path; empty without a path.

    Args:
        strokes: Strokes of the tool.
        path: The path.
    """
    import shapely

    points = np.concatenate([np.zeros((0, 2)), *(stroke.points for stroke in strokes)])
    if not path or not len(points):
        return np.zeros(0)
    chords = [np.stack((stretch.points[:-1], stretch.points[1:]), axis=1) for stretch in path]
    tree = shapely.STRtree(np.asarray(shapely.linestrings(np.concatenate(chords))))
    _, distance = tree.query_nearest(shapely.points(points), return_distance=True, all_matches=False)
    return np.asarray(distance)
