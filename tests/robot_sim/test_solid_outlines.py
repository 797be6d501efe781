"""Outlines without holes of known ground, by which perception explains returns."""

import shapely

from touchline.schemas.known_ground import KnownObstacle
from touchline.services.robot_sim.solid_outlines import solid_outlines

SQUARE = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
ROOMS = tuple(((x, y), (x + 2.0, y), (x + 2.0, y + 2.0), (x, y + 2.0)) for x in (1.0, 6.0) for y in (1.0, 6.0))


def test_the_rooms_of_an_outline_stay_free() -> None:
    found = solid_outlines([KnownObstacle(id="walls", corners=SQUARE, holes=ROOMS)])
    pieces = [shapely.Polygon(corners) for corners in found]
    assert all(piece.is_valid for piece in pieces)
    assert shapely.union_all(pieces).equals(shapely.Polygon(SQUARE, ROOMS))


def test_an_outline_without_holes_is_kept() -> None:
    assert solid_outlines([KnownObstacle(id="block", corners=SQUARE)]) == [SQUARE]
