"""Parts of areas for several robots: strips side by side, of given shares, that overlap a little."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
import shapely

from touchline.core.ground_pieces import wide_parts
from touchline.core.plain_sum import plain_sum
from touchline.core.robust_overlay import as_area, intersection
from touchline.schemas.template import Area, Template
from touchline.services.planner.coverage.shapes import Area as Ground
from touchline.services.planner.coverage.shapes import turned

Grounds = Mapping[str, Ground]
"""Parts of areas by area id (m, map frame)."""

HALVINGS = 40
"""Bisection steps for the position of a cut."""
MOST_PIECES, MOST_CORNERS = 60, 900
"""Limits of pieces and of corners of a piece, below those of a template (100 areas, 1000 corners)."""
_FAR_M = 1e5


def strips(grounds: Grounds, shares: Sequence[float], angle_rad: float, overlap_m: float) -> list[shapely.Polygon]:
    """Divide ground into parallel strips of given shares.

    Args:
        grounds: Ground to divide.
        shares: Share of each strip in the whole ground; their sum is 1.
        angle_rad: Direction of the strips, counter-clockwise from +x.
        overlap_m: Overlap of neighbours.
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
    """Ground within a strip, without pieces that are narrower than `least_m` everywhere.

    Args:
        grounds: Ground by area id (m, map frame).
        strip: Strip (m, map frame).
        least_m: Minimum width of a piece; 0: all pieces.
    """
    found = {name: wide_parts(as_area(intersection(ground, strip)), least_m) for name, ground in grounds.items()}
    return {name: part for name, part in found.items() if not part.is_empty}


def _level(ground: Ground, wanted_m2: float, low: float, high: float) -> float:
    """Level below which `wanted_m2` of the ground lie."""
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        below = intersection(ground, shapely.box(-_FAR_M, -_FAR_M, _FAR_M, middle)).area
        low, high = (middle, high) if below < wanted_m2 else (low, middle)
    return 0.5 * (low + high)


def size_m2(grounds: Grounds) -> float:
    """Total area (m²)."""
    return plain_sum(ground.area for ground in grounds.values())


def share_template(template: Template, grounds: Grounds) -> Template:
    """Copy of a template with only these parts of its areas; each piece is an area, the first under the area's id."""
    areas = list[Area]()
    for area in template.areas:
        pieces = sorted(shapely.get_parts(grounds.get(area.id, shapely.MultiPolygon())), key=lambda each: -each.area)
        for number, piece in enumerate(pieces[:MOST_PIECES], start=1):
            name = area.id if number == 1 else f"{area.id} ({number})"
            areas.append(_drawn(area, name, piece))
    return template.model_copy(update={"areas": tuple(areas)})


def _drawn(area: Area, name: str, piece: shapely.Polygon) -> Area:
    """Convert a piece of an area to an area of a template."""
    tolerance_m, simple = 1e-3, piece
    while len(simple.exterior.coords) > MOST_CORNERS and tolerance_m < 1.0:
        tolerance_m *= 2.0
        simple = shapely.simplify(piece, tolerance_m)
    rings = [tuple((x, y) for x, y in ring.coords[:-1]) for ring in (simple.exterior, *simple.interiors)]
    # A copy would keep the cached polygon of the whole area.
    return Area.model_construct(id=name, outline=rings[0], holes=tuple(rings[1:]), angle_deg=area.angle_deg)


def directions(angle_rad: float) -> tuple[float, float]:
    """Directions of cuts that are tried: along the lanes, and across them."""
    return angle_rad, angle_rad + 0.5 * math.pi
