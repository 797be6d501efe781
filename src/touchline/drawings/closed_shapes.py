"""Closed shapes of a drawing as areas with holes.

The parts of one path or hatch enclose the ground by its fill rule. Of nested shapes the inner one is a hole, one in a
hole is an area again, and so on, regardless of colours; a repeated outline, such as a hatch and its edge, counts once.
Shapes that overlap in part are united; those that share an edge stay two.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError

from touchline.core.plain_sum import plain_sum
from touchline.core.robust_overlay import (
    buffer,
    difference,
    intersection,
    symmetric_difference,
    union,
    union_of_two,
)
from touchline.drawings.deviation import sampled
from touchline.drawings.fill_rule import GRID_M, enclosed
from touchline.drawings.flatten import CHORD_M, ring_of
from touchline.drawings.outline import FillRule, Outline, Smooth
from touchline.schemas.errors import SpecError
from touchline.schemas.plain_text import plain
from touchline.schemas.template import MIN_AREA_M2, Area, Polygon

if TYPE_CHECKING:
    import shapely

#: Limits of a template.
MOST_AREAS, MOST_HOLES, MOST_CORNERS = 100, 100, 1000
#: Maximum distance between the ends of a closed outline, m.
MEET_M = 1e-3
#: Tolerance for simplifying an outline of more corners, as a fraction of the detail; at least `CHORD_M`.
SIMPLER_SHARE = 0.1


@dataclass(frozen=True)
class FoundAreas:
    """The areas of a drawing.

    Attributes:
        areas: In m, largest first.
        mended: Names of shapes that cross themselves, but have a clear inside.
        united: Number of shapes that overlapped others in part and were united with them.
        small: Number of areas and holes that were too small, or enclose nothing.
    """

    areas: tuple[Area, ...]
    mended: tuple[str, ...]
    united: int
    small: int


def is_shape(outline: Outline) -> bool:
    """True if an outline is closed and so encloses something."""
    if outline.closed:
        return True
    start, end = sampled(outline.pieces[0], 2)[0], sampled(outline.pieces[-1], 2)[-1]
    return bool(
        np.hypot(*(end - start)) <= MEET_M and (len(outline.pieces) > 1 or isinstance(outline.pieces[0], Smooth))
    )


def areas_of(source: str, outlines: Sequence[Outline], feature_m: float) -> FoundAreas:
    """Find the areas of closed outlines.

    Args:
        source: Name of the file, for errors.
        outlines: Outlines for which `is_shape` is true.
        feature_m: Areas and holes smaller than its square are left out.

    Raises:
        SpecError: A shape's inside is not clear, or a limit of templates is exceeded.
    """
    least_m2 = max(feature_m**2, MIN_AREA_M2)
    polygons, mended = _enclosed(source, outlines)
    rings = _different(sorted(polygons, key=lambda each: -each[1].area))
    elements = {outline.area or outline.name for outline in outlines}
    large = [(name, ring) for name, ring in rings if ring.area >= least_m2]
    found, united = _nested(large)
    areas: list[Area] = []
    small = len(rings) - len(large) + len(elements - {name for name, _ in polygons})
    for name, polygon in found:
        for part in _parts(polygon):
            if part.area >= least_m2:
                areas.append(_area(source, name, part, feature_m))
            else:
                small += 1
    if len(areas) > MOST_AREAS:
        remedy = "name layers by --layer, or give a larger --detail"
        raise SpecError(
            source, "", f"makes {len(areas):,} areas, more than the {MOST_AREAS} that can be planned", remedy
        )
    return FoundAreas(_named(areas), tuple(mended), united, small)


def boundary_of(source: str, layer: str, outlines: Sequence[Outline], feature_m: float) -> Polygon:
    """Find the largest outline of a layer; the arguments are those of `areas_of`.

    Raises:
        SpecError: The layer has no closed outline.
    """
    polygons, _ = _enclosed(source, [outline for outline in outlines if is_shape(outline)])
    if not polygons:
        remedy = "close the outline of the boundary, or name another layer"
        raise SpecError(source, layer, "has no closed shape for the boundary", remedy)
    name, largest = max(polygons, key=lambda each: each[1].area)
    try:
        return Polygon(corners=_corners(source, name, largest.exterior, feature_m))
    except ValidationError as error:
        problem = error.errors()[0]["msg"].removeprefix("Value error, ")
        raise SpecError(source, name, f"makes no boundary: {problem}", "redraw it") from error


def _enclosed(source: str, outlines: Sequence[Outline]) -> "tuple[list[tuple[str, shapely.Polygon]], list[str]]":
    """Filled rings at the edges of what the elements enclose, and the names of elements that cross themselves."""
    import shapely

    elements: dict[str, list[Outline]] = {}
    for outline in outlines:
        elements.setdefault(outline.area or outline.name, []).append(outline)
    polygons: list[tuple[str, shapely.Polygon]] = []
    mended = []
    for name, parts in elements.items():
        rings = [ring for ring in map(ring_of, parts) if len(ring) > 2]
        if not rings:
            continue
        if any(not shapely.LinearRing(ring).is_simple for ring in rings):
            mended.append(name)
        rule = parts[0].rule
        inside = enclosed(rings, rule or FillRule.EVEN_ODD)
        if rule is None and not _same(inside, enclosed(rings, FillRule.NONZERO)):
            remedy = "draw its outline without crossings, or save it as SVG with a fill rule"
            raise SpecError(source, name, "crosses itself and goes round some of its inside twice", remedy)
        for polygon in inside:
            polygons += [(name, shapely.Polygon(edge)) for edge in (polygon.exterior, *polygon.interiors)]
    return polygons, mended


def _same(first: "list[shapely.Polygon]", second: "list[shapely.Polygon]") -> bool:

    apart = symmetric_difference(union(first), union(second))
    return bool(apart.area <= CHORD_M * plain_sum(polygon.length for polygon in second))


def _slack_m2(ring: "shapely.Polygon") -> float:
    """Area along a ring's edge below which a difference counts as none (m²)."""
    return float(min(CHORD_M * ring.length, 0.25 * ring.area))


def _different(rings: "Iterable[tuple[str, shapely.Polygon]]") -> "list[tuple[str, shapely.Polygon]]":
    kept: list[tuple[str, shapely.Polygon]] = []
    for name, ring in rings:
        box = np.array(ring.bounds)
        alike = (other for _, other in kept if np.abs(box - other.bounds).max() <= 2 * CHORD_M)
        if not any(symmetric_difference(ring, other).area <= _slack_m2(ring) for other in alike):
            kept.append((name, ring))
    return kept


def _nested(rings: "Iterable[tuple[str, shapely.Polygon]]") -> tuple[list[tuple[str, Any]], int]:
    """Nest rings, the largest first: within an area a ring is a hole, across an edge it joins, elsewhere an area."""
    found: list[tuple[str, Any]] = []
    united = 0
    for name, ring in rings:
        common = [intersection(polygon, ring).area if polygon.intersects(ring) else 0.0 for _, polygon in found]
        slack = _slack_m2(ring)
        met = [i for i, area in enumerate(common) if area > slack]
        within = [i for i in met if common[i] >= ring.area - slack]
        if within:
            host, polygon = found[within[0]]
            found[within[0]] = (host, difference(polygon, ring))
        elif met:
            joined: Any = ring
            for i in met:
                joined = union_of_two(joined, found[i][1])
            first = found[met[0]][0]
            found = [each for i, each in enumerate(found) if i not in met] + [(first, joined)]
            united += 1
        else:
            found.append((name, ring))
    return found, united


def _parts(polygon: Any) -> "list[shapely.Polygon]":
    """Polygons of a shape, each with its holes apart from its edge and from each other.

    Where they touch in a point, a piece is cut out so that the hole becomes a bay.
    """
    import shapely

    polygon = shapely.set_precision(polygon, GRID_M)
    rings = [ring for part in _polygons(polygon) for ring in (part.exterior, *part.interiors)]
    touching = [
        buffer(intersection(rings[i], rings[j]), 0.5 * CHORD_M, quad_segs=1)
        for i in range(len(rings))
        for j in range(i)
        if rings[i].intersects(rings[j])
    ]
    if touching:
        polygon = shapely.difference(polygon, shapely.union_all(touching), grid_size=GRID_M)
    return _polygons(polygon)


def _polygons(found: Any) -> "list[shapely.Polygon]":
    import shapely

    parts = shapely.get_parts(found).tolist()
    return [part for part in parts if part.geom_type == "Polygon" and not part.is_empty]


def _area(source: str, name: str, polygon: "shapely.Polygon", feature_m: float) -> Area:
    import shapely

    holes = [hole for hole in polygon.interiors if shapely.Polygon(hole).area >= max(feature_m**2, MIN_AREA_M2)]
    if len(holes) > MOST_HOLES:
        problem = f"has {len(holes):,} holes, more than the {MOST_HOLES} of an area"
        raise SpecError(source, name, problem, "give a larger --detail, or leave their layer out with --layer")
    outline, *inner = (_corners(source, name, ring, feature_m) for ring in (polygon.exterior, *holes))
    try:
        return Area(id=plain(name, 80), outline=outline, holes=tuple(inner))
    except ValidationError as error:
        problem = error.errors()[0]["msg"].removeprefix("Value error, ")
        raise SpecError(source, name, f"makes no area: {problem}", "redraw or remove it") from error


def _corners(source: str, name: str, ring: Any, feature_m: float) -> tuple[tuple[float, float], ...]:
    """Corners of a closed line, without those on the line between their neighbours."""
    import shapely

    corners = shapely.get_coordinates(shapely.Polygon(ring).simplify(1e-9))[:-1]
    if len(corners) > MOST_CORNERS:
        tolerance_m = max(CHORD_M, SIMPLER_SHARE * feature_m)
        corners = shapely.get_coordinates(shapely.Polygon(ring).simplify(tolerance_m))[:-1]
    if len(corners) > MOST_CORNERS:
        problem = f"has {len(corners):,} corners, more than the {MOST_CORNERS:,} of an outline"
        raise SpecError(source, name, problem, "give a larger --detail, or simplify it")
    return tuple(map(tuple, corners.tolist()))


def _named(areas: list[Area]) -> tuple[Area, ...]:
    """Give the areas unique ids, the largest first."""
    seen: set[str] = set()
    named = []
    for area in sorted(areas, key=lambda each: -each.polygon.area):
        name, count = area.id, 1
        while name in seen:
            count += 1
            name = f"{area.id[:74]}-{count}"
        seen.add(name)
        named.append(area.model_copy(update={"id": name}))
    return tuple(named)
