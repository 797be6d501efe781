"""Parts of areas for several robots: cut side by side, of given shares, overlapping a little at the joints."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
import shapely

from touchline.core.robust_overlay import buffer, intersection
from touchline.schemas.template import Area, Template
from touchline.services.planner.coverage.shapes import Area as Ground
from touchline.services.planner.coverage.shapes import as_area, turned

Grounds = Mapping[str, Ground]
"""Of areas by their ids, what of each is meant (m, map frame)."""

HALVINGS = 40
"""So often the interval in which a cut lies is halved."""
MOST_PIECES, MOST_CORNERS = 60, 900
"""A template has no more areas (100), and no more corners to an outline (1000)."""
_FAR_M = 1e5


def strips(grounds: Grounds, shares: Sequence[float], angle_rad: float, overlap_m: float) -> list[shapely.Polygon]:
    """Strips side by side along lines of one direction, in which there are shares of some ground.

    Args:
        grounds: What is to be shared.
        shares: Of the whole ground, of each strip; their sum is 1.
        angle_rad: Of the strips, counter-clockwise from +x.
        overlap_m: By which neighbours overlap.
    """
    level = shapely.transform(
        shapely.MultiPolygon([part for ground in grounds.values() for part in shapely.get_parts(ground)]),
        lambda points: turned(points, -angle_rad),
    )
    _, low, _, high = level.bounds
    reached = np.cumsum(shares)[:-1]
    levels = [-_FAR_M, *(_level(level, float(share) * level.area, low, high) for share in reached), _FAR_M]
    boxes = [
        shapely.box(-_FAR_M, below - 0.5 * overlap_m, _FAR_M, above + 0.5 * overlap_m)
        for below, above in pairwise(levels)
    ]
    return [shapely.transform(each, lambda points: turned(points, angle_rad)) for each in boxes]


def parts_in(grounds: Grounds, strip: shapely.Polygon, least_m: float) -> Grounds:
    """What of some ground lies in a strip; pieces that are nowhere as wide are left to the neighbour, or left out."""
    found = {name: wide_parts(as_area(intersection(ground, strip)), least_m) for name, ground in grounds.items()}
    return {name: part for name, part in found.items() if not part.is_empty}


def _level(ground: Ground, wanted_m2: float, low: float, high: float) -> float:
    """The level below which so much of some ground lies."""
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        below = intersection(ground, shapely.box(-_FAR_M, -_FAR_M, _FAR_M, middle)).area
        low, high = (middle, high) if below < wanted_m2 else (low, middle)
    return 0.5 * (low + high)


def wide_parts(ground: Ground, least_m: float) -> Ground:
    """The pieces of some ground that are somewhere as wide as that."""
    kept = [part for part in shapely.get_parts(ground) if not buffer(part, -0.5 * least_m).is_empty]
    return kept[0] if len(kept) == 1 else shapely.MultiPolygon(kept)


def size_m2(grounds: Grounds) -> float:
    """Of all together."""
    return sum(ground.area for ground in grounds.values())


def share_template(template: Template, grounds: Grounds) -> Template:
    """The template with these parts of its areas alone; each piece is an area, the first one under the area's id."""
    areas = list[Area]()
    for area in template.areas:
        pieces = sorted(shapely.get_parts(grounds.get(area.id, shapely.MultiPolygon())), key=lambda each: -each.area)
        for number, piece in enumerate(pieces[:MOST_PIECES], start=1):
            name = area.id if number == 1 else f"{area.id} ({number})"
            areas.append(_drawn(area, name, piece))
    return template.model_copy(update={"areas": tuple(areas)})


def _drawn(area: Area, name: str, piece: shapely.Polygon) -> Area:
    """A piece of an area as one of a template."""
    tolerance_m, simple = 1e-3, piece
    while len(simple.exterior.coords) > MOST_CORNERS and tolerance_m < 1.0:
        tolerance_m *= 2.0
        simple = shapely.simplify(piece, tolerance_m)
    rings = [tuple((x, y) for x, y in ring.coords[:-1]) for ring in (simple.exterior, *simple.interiors)]
    # A copy would keep the polygon of the whole area, which that has worked out before.
    return Area.model_construct(id=name, outline=rings[0], holes=tuple(rings[1:]), angle_deg=area.angle_deg)


def directions(angle_rad: float) -> tuple[float, float]:
    """Of cuts that are tried: along the lanes, and across them."""
    return angle_rad, angle_rad + 0.5 * math.pi
