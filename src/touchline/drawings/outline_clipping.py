"""Clipping of outlines by clip paths and the edges of viewports."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from touchline.drawings.arc_columns import COINCIDENT_M
from touchline.drawings.deviation import sampled
from touchline.drawings.fill_rule import enclosed
from touchline.drawings.fit import fit_outline
from touchline.drawings.flatten import CHORD_M, ring_of
from touchline.drawings.outline import FillRule, Floats, Outline
from touchline.schemas.curves import Curve

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

#: Tolerance outside a region, m, so that an outline on its edge shows.
SLACK_M = 2 * CHORD_M
#: Relative width up to which an enclosed shape counts as empty.
THIN = 1e-9
#: Turn (rad) of the chords by which crossings of arcs with an edge are found.
_BEND_RAD = 0.02


def region_of(outlines: Sequence[Outline]) -> "BaseGeometry":
    """Region that shapes enclose together; those of one area by their common fill rule."""
    import shapely

    elements: dict[str, list[Outline]] = {}
    for outline in outlines:
        elements.setdefault(outline.area or outline.name, []).append(outline)
    inside: list[shapely.Polygon] = []
    for parts in elements.values():
        inside += enclosed([ring_of(part) for part in parts], parts[0].rule or FillRule.NONZERO)
    return shapely.union_all(inside)


def clipped(outlines: Sequence[Outline], region: "BaseGeometry") -> list[Outline]:
    """Clip the outlines of one element to a region: lines are cut, areas get the region's edge."""
    import shapely

    room = region.buffer(SLACK_M)
    if all(room.covers(shapely.LineString(_corners(outline))) for outline in outlines):
        return list(outlines)
    solid = [outline for outline in outlines if outline.filled]
    lines = (cut for outline in outlines if not outline.filled for cut in _lines(outline, room, region))
    return [*_areas(solid, region), *lines]


def encloses_nothing(outline: Outline) -> bool:
    """True if all of an outline is on one line."""
    points = np.concatenate([sampled(piece, 9) for piece in outline.pieces])
    away = points - points[0]
    far = away[int(np.argmax((away**2).sum(axis=1)))]
    return bool(np.abs(away[:, 0] * far[1] - away[:, 1] * far[0]).max() <= THIN * float(far @ far))


def _corners(outline: Outline) -> Floats:
    points = ring_of(outline)
    if outline.closed or len(points) < 2:
        points = np.vstack((points, points[:1]))
    return points


def _inside(outlines: Sequence[Outline]) -> Any:
    import shapely

    return shapely.union_all(enclosed([ring_of(each) for each in outlines], outlines[0].rule or FillRule.NONZERO))


def _areas(outlines: Sequence[Outline], region: "BaseGeometry") -> Iterator[Outline]:
    import shapely

    if not outlines:
        return
    count = 0
    for part in shapely.get_parts(_inside(outlines).intersection(region)).tolist():
        if part.geom_type != "Polygon" or part.is_empty:
            continue
        for ring in (part.exterior, *part.interiors):
            count += 1
            corners = [(x, y) for x, y in shapely.get_coordinates(ring).tolist()]
            pieces = tuple(Curve.from_line(a, b) for a, b in pairwise(corners) if a != b)
            name = outlines[0].name if count == 1 else f"{outlines[0].name}-cut-{count}"
            yield replace(outlines[0], name=name, pieces=pieces, closed=True, rule=FillRule.EVEN_ODD)


def _lines(outline: Outline, room: "BaseGeometry", region: "BaseGeometry") -> Iterator[Outline]:
    """Maximal parts of a line inside a region."""
    chains: list[list[Curve]] = [[]]
    for curve in fit_outline(outline):
        for begin, end, shown in _stretches(curve, room, region):
            if shown:
                chains[-1].append(part_of(curve, begin, end))
            if not shown or end < curve.length_m:
                chains.append([])
    found = [chain for chain in chains if chain]
    if len(found) > 1 and outline.closed and chains[0] and chains[-1]:  # it goes on where it began
        found = [found[-1] + found[0], *found[1:-1]]
    for count, chain in enumerate(found, 1):
        name = outline.name if count == 1 else f"{outline.name}-cut-{count}"
        yield replace(outline, name=name, pieces=tuple(chain), closed=False)


def _stretches(curve: Curve, room: "BaseGeometry", region: "BaseGeometry") -> Iterator[tuple[float, float, bool]]:
    """Intervals (begin, end, visible) along a curve, m."""
    import shapely

    count = 2 + int(abs(curve.curvature_1pm) * curve.length_m / _BEND_RAD)
    chords = shapely.LineString(sampled(curve, count))
    met = shapely.get_coordinates(chords.intersection(region.boundary))
    places = [curve.length_m * chords.project(shapely.Point(at), normalized=True) for at in met]
    stops = sorted({0.0, curve.length_m, *(s for s in places if COINCIDENT_M < s < curve.length_m - COINCIDENT_M)})
    for begin, end in pairwise(stops):
        if end - begin > COINCIDENT_M:
            x, y, _, _ = curve.at((begin + end) / 2)
            yield begin, end, bool(room.covers(shapely.Point(float(x), float(y))))


def part_of(curve: Curve, begin_m: float, end_m: float) -> Curve:
    """Part of a curve between two arc lengths."""
    if begin_m == 0.0 and end_m == curve.length_m:
        return curve
    x, y, heading, _ = (float(v) for v in curve.at(begin_m))
    return replace(curve, x_m=x, y_m=y, heading_rad=heading, length_m=end_m - begin_m)
