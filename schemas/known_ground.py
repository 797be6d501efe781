"""Known ground: where a robot's body may be on its way to a goal."""

from __future__ import annotations

from typing import Annotated, Final, Self

from pydantic import Field

from touchline.schemas.spec import Spec
from touchline.schemas.template import Name, Position, Template

Ring = Annotated[tuple[Position, ...], Field(min_length=3, max_length=20_000)]
"""A closed outline, corner by corner, either way round; the last corner joins the first, metres."""


class KnownObstacle(Spec):
    """Outline that the body keeps off, and holes in it in which the body may be."""

    id: Name
    """Name."""
    corners: Ring
    """Corners, m."""
    holes: Annotated[tuple[Ring, ...], Field(max_length=10_000)] = ()
    """Outlines inside, m."""


class KnownGround(Spec):
    """Boundary that the body stays inside, and obstacles that it keeps off, in the map frame."""

    boundary: Ring | None = None
    """Corners of the boundary, m; null: none is known."""
    obstacles: Annotated[tuple[KnownObstacle, ...], Field(max_length=10_000)] = ()
    """Outlines that the body keeps off."""

    @classmethod
    def of(cls, template: Template) -> Self:
        """Boundary and obstacles of a template in the map frame."""
        return cls(
            boundary=template.boundary.corners if template.boundary else None,
            obstacles=tuple(KnownObstacle(id=each.id, corners=each.corners) for each in template.obstacles),
        )


OPEN_GROUND: Final = KnownGround()
"""Ground of which nothing is known."""
