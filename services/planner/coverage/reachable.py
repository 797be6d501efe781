"""What the tool can pass over at all, over all headings."""

import math

import numpy as np
import shapely

from touchline.services.planner.coverage.free_space import FreeSpace
from touchline.services.planner.coverage.shapes import Area, as_area
from touchline.services.planner.geometry.clothoid import Floats

HEADINGS = 72


def reachable(area: Area, space: FreeSpace) -> Area:
    """What of an area the tool can pass over, over all headings (every 5°): places times the tool's width.

    Whether the machine can get from each of these places to the others is not asked.
    """
    covered: list[Area] = []
    half = 0.5 * space.machine.width_m
    for heading in (np.arange(HEADINGS) * math.tau / HEADINGS).tolist():
        places = space.at(heading)
        across = half * np.array((-math.sin(heading), math.cos(heading)))
        covered += [_smeared(place, across) for place in shapely.get_parts(places)]
    return as_area(shapely.union_all(covered).intersection(area))


def _smeared(place: shapely.Polygon, across: Floats) -> Area:
    """What a line from −across to +across passes over where its middle is within a polygon."""
    quads = []
    for ring in (place.exterior, *place.interiors):
        points = np.array(ring.coords)[:, :2]
        first, last = points[:-1], points[1:]
        quads.append(np.stack((first - across, last - across, last + across, first + across), axis=1))
    shapes = np.asarray(shapely.convex_hull(shapely.polygons(np.concatenate(quads))))
    return as_area(shapely.union_all([place, *shapes.tolist()]))
