"""Area method `parallel`: straight swaths side by side, back and forth, over a polygon with holes.

Across the swaths the area is cut into bands, at most as high as the tool is wide. The swath in the middle of a band
leads from where the area's part in the band begins to where it ends, so that all of the part is covered; where a hole
or a bay parts the band from edge to edge, there is a swath on either side. As every place along a swath has some of the
area within its band, nothing that is covered lies further than the tool's width outside the area, and no swath further
than half of it: slanted ends are stepped outward, never inward.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
import shapely

from touchline.core.robust_overlay import intersections
from touchline.schemas.curves import Curve
from touchline.schemas.template import Area
from touchline.services.planner.coverage.shapes import extents, turned

# Overlap with a band (m) below which an edge along the swaths only touches it.
BAND_OVERLAP_M = 1e-6
# A shorter swath (m) is lengthened about its middle: a template's lines are longer.
SHORTEST_M = 0.02
# Without an angle, swaths along this many of the longest edges are compared; angles that differ by less (rad) are the
# same.
DIRECTIONS, SAME_RAD = 24, 1e-6

# A swath in the rotated frame, in which swaths lie along x: start x, end x, and y (m).
Span = tuple[float, float, float]


def parallel(area: Area, width_m: float) -> list[Curve]:
    """Lay swaths at the area's angle; if it has none, along the edge that needs the fewest.

    Among angles with equally many swaths, the one with the shortest total length wins.

    Args:
        area: In the map frame.
        width_m: Working width of the tool (m): swaths lie no further apart.
    """
    angles = [math.radians(area.angle_deg)] if area.angle_deg is not None else _edge_angles(area)
    offers = [(angle, spans(area.polygon, angle, width_m)) for angle in angles]
    angle, chosen = min(offers, key=lambda offer: (len(offer[1]), sum(abs(b - a) for a, b, _ in offer[1])))
    return [_swath(span, angle) for span in chosen]


def spans(polygon: shapely.Polygon, angle_rad: float, width_m: float) -> list[Span]:
    """Swaths over a polygon at an angle, in alternating directions, in the frame rotated by the angle.

    Args:
        polygon: In the map frame (m); may have holes.
        angle_rad: Direction of the swaths, counter-clockwise from +x of the map frame.
        width_m: Working width of the tool (m).
    """
    level_frame = shapely.transform(polygon, lambda points: turned(points, -angle_rad))
    left, low, right, high = level_frame.bounds
    count = max(1, math.ceil((high - low) / width_m - BAND_OVERLAP_M))
    # The outer swaths lie half a width inside, or in the middle of a narrower area; bands meet midway between swaths.
    inset = 0.5 * min(width_m, high - low)
    levels = np.linspace(low + inset, high - inset, count) if count > 1 else np.array([0.5 * (low + high)])
    borders = np.concatenate(([low], 0.5 * (levels[1:] + levels[:-1]), [high]))
    sides = np.full(count, left - 1.0), np.full(count, right + 1.0)
    bands = shapely.box(sides[0], borders[:-1] + BAND_OVERLAP_M, sides[1], borders[1:] - BAND_OVERLAP_M)
    found: list[Span] = []
    for index, (level, part) in enumerate(zip(levels.tolist(), intersections(level_frame, bands), strict=True)):
        row = [_long_enough(a, b, level) for a, b in extents(part)]
        found += row if index % 2 == 0 else [(b, a, y) for a, b, y in reversed(row)]
    return found


def _long_enough(a: float, b: float, y: float) -> Span:
    short = max(SHORTEST_M - (b - a), 0.0)
    return a - 0.5 * short, b + 0.5 * short, y


def _edge_angles(area: Area) -> list[float]:
    """Directions (rad, in [0, π)) of the longest edges, each once, the longest first."""
    edges = sorted(_edges(area), key=abs, reverse=True)
    angles: list[float] = []
    for edge in edges:
        angle = math.atan2(edge.imag, edge.real) % math.pi
        if all(abs(math.remainder(angle - known, math.pi)) > SAME_RAD for known in angles):
            angles.append(angle)
    return angles[:DIRECTIONS]


def _edges(area: Area) -> Iterator[complex]:
    for ring in (area.outline, *area.holes):
        yield from (complex(*b) - complex(*a) for a, b in pairwise((*ring, ring[0])))


def _swath(span: Span, angle_rad: float) -> Curve:
    """Convert a swath to the map frame."""
    a, b, y = span
    ends: Sequence[list[float]] = turned(np.array(((a, y), (b, y))), angle_rad).tolist()
    return Curve.from_line((ends[0][0], ends[0][1]), (ends[1][0], ends[1][1]))
