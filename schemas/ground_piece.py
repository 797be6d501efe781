"""Pieces of areas, such as what remains to be covered of them."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from touchline.schemas.known_ground import Ring
from touchline.schemas.spec import Spec
from touchline.schemas.template import Name

if TYPE_CHECKING:
    import shapely


class GroundPiece(Spec):
    """Piece of the area of a template."""

    area: Name
    """Id of the area."""
    corners: Ring
    """Corners, m, map frame."""
    holes: Annotated[tuple[Ring, ...], Field(max_length=10_000)] = ()
    """Outlines inside that are no part of it."""

    @cached_property
    def polygon(self) -> shapely.Polygon:
        """As a polygon, m."""
        import shapely

        return shapely.Polygon(self.corners, self.holes)

    @classmethod
    def of(cls, area: str, polygon: shapely.Polygon) -> GroundPiece:
        """Return a polygon (m, map frame) as a piece of an area."""
        rings = [tuple((x, y) for x, y in ring.coords[:-1]) for ring in (polygon.exterior, *polygon.interiors)]
        return cls(area=area, corners=rings[0], holes=tuple(rings[1:]))


class RemainingPieces(Spec):
    """Pieces of a template's areas that are still to be covered."""

    pieces: Annotated[tuple[GroundPiece, ...], Field(min_length=1, max_length=10_000)]
    """The pieces."""
