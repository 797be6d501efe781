"""Things that a robot keeps off on its way to a goal: those that it sees, and those that its plan knows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple, Self

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from touchline.core.robust_overlay import as_area, buffer, difference
from touchline.schemas.known_ground import KnownObstacle, Ring
from touchline.services.robot_sim.goal_way.way_ahead import WayAhead

Floats = NDArray[np.float64]

SPACING_M: Final = 0.04
"""Largest distance between places of a known outline: gaps of returns of this size are closed, too."""
_SIMPLIFIED_M: Final = 0.01
_POINT_M: Final = 0.015
"""Radius of a return."""
_CLOSED_M: Final = 0.06
"""Half of the largest gap between returns that is taken to be closed."""


class KeptThings(NamedTuple):
    """Things of one kind.

    Attributes:
        places_m: (n, 2) places on them, map frame.
        farther_m: Distance kept from them beyond that from things that stand.
    """

    places_m: Floats
    farther_m: float = 0.0

    def clearance_m(self, way: WayAhead, body: Floats, most_m: float) -> float:
        """Return the least distance along a way, less `farther_m`; arguments as of `WayAhead.clearance_m`."""
        return way.clearance_m(body, self.places_m, most_m + self.farther_m) - self.farther_m


class PlannedThings(NamedTuple):
    """Things of one kind as a plan is to take them.

    Attributes:
        things: The things, those near to where the way begins moved off.
        clear: Ground without things in any case.
    """

    things: KeptThings
    clear: BaseGeometry

    def of_clear(self, known: KeptThings) -> Self:
        """Return those of known things, moved off, that were on the clear ground: the others have their outlines."""
        inside = shapely.contains_xy(self.clear, known.places_m)
        return self._replace(things=self.things._replace(places_m=self.things.places_m[inside]))

    def outlines(self, name: str) -> tuple[KnownObstacle, ...]:
        """Return outlines with this name and a number, in which gaps that no body fits into are closed."""
        places_m, farther_m = self.things
        if not len(places_m):
            return ()
        grown = shapely.union_all(shapely.buffer(shapely.points(places_m), _CLOSED_M, quad_segs=3))
        shape = as_area(buffer(as_area(grown), -_CLOSED_M + _POINT_M, quad_segs=1)).simplify(_SIMPLIFIED_M)
        shape = as_area(difference(shape, self.clear))
        if farther_m:
            shape = as_area(buffer(shape, farther_m, quad_segs=4).simplify(_SIMPLIFIED_M))
        return tuple(_obstacle(f"{name} {number}", part) for number, part in enumerate(_parts(shape), 1))


def places_on(obstacles: Sequence[KnownObstacle]) -> Floats:
    """Return places (n, 2) along all outlines of obstacles."""
    rings = [shapely.LinearRing(ring) for each in obstacles for ring in (each.corners, *each.holes)]
    return np.ascontiguousarray(shapely.get_coordinates(shapely.segmentize(rings, SPACING_M)).reshape(-1, 2))


def cut_out(obstacles: Sequence[KnownObstacle], clear: BaseGeometry) -> Iterator[KnownObstacle]:
    """Yield what is left of obstacles without some ground."""
    for each in obstacles:
        shape = shapely.Polygon(each.corners, each.holes)
        if not shape.intersects(clear):
            yield each
            continue
        yield from (_obstacle(each.id, part) for part in _parts(as_area(difference(shape, clear))))


def moved_off(things_m: Floats, area: BaseGeometry, by_m: float) -> Floats:
    """Return places of things, those in an area moved outward: a wall through it goes round it, and stays closed.

    Args:
        things_m: (n, 2) places, map frame.
        area: The area.
        by_m: Distance by which they are moved.
    """
    shapely.prepare(area)
    inside = shapely.contains_xy(area, things_m)
    places_m = things_m[inside]
    if not len(places_m):
        return things_m
    lines = shapely.shortest_line(shapely.points(places_m), shapely.boundary(area))
    outward_m = shapely.get_coordinates(lines)[1::2] - places_m
    moved_m = things_m.copy()
    moved_m[inside] += by_m * outward_m / np.maximum(np.hypot(*outward_m.T), 1e-9)[:, None]
    return moved_m


def _parts(shape: BaseGeometry) -> list[shapely.Polygon]:
    return [part for part in shapely.get_parts(shape) if part.area > 0.0]


def _obstacle(name: str, part: shapely.Polygon) -> KnownObstacle:
    return KnownObstacle(id=name, corners=_ring(part.exterior), holes=tuple(map(_ring, part.interiors)))


def _ring(line: shapely.LinearRing) -> Ring:
    corners: Sequence[tuple[float, float]] = [(x, y) for x, y in shapely.get_coordinates(line)[:-1].tolist()]
    return tuple(corners)
