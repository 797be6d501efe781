"""Outlines without holes, as perception explains returns by them."""

from __future__ import annotations

from collections.abc import Iterable

from touchline.schemas.known_ground import KnownObstacle, Ring


def solid_outlines(obstacles: Iterable[KnownObstacle]) -> list[Ring]:
    """Return outlines that cover the same ground: one with holes is cut through the middle of each."""
    found = list[Ring]()
    for each in obstacles:
        found += _cut(each) if each.holes else [each.corners]
    return found


def _cut(obstacle: KnownObstacle) -> list[Ring]:
    import shapely

    from touchline.core.robust_overlay import as_area, intersection

    left, found = [shapely.Polygon(obstacle.corners, obstacle.holes)], list[Ring]()
    while left:
        part = left.pop()
        if not part.interiors:
            found.append(tuple((x, y) for x, y in shapely.get_coordinates(part.exterior)[:-1].tolist()))
            continue
        west, south, east, north = part.bounds
        middle = part.interiors[0].centroid.x
        for half in (shapely.box(west, south, middle, north), shapely.box(middle, south, east, north)):
            left += [each for each in shapely.get_parts(as_area(intersection(part, half))) if each.area > 0.0]
    return found
