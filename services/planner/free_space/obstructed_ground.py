"""Ground that is obstructed for a body: everything outside a boundary, and obstacles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import shapely

from touchline.core.robust_overlay import as_area, buffer, difference, union
from touchline.services.planner.free_space.convex_parts import convex_parts
from touchline.services.planner.free_space.wall_grid import WallGrid
from touchline.services.planner.geometry.clothoid import Floats

# Without a boundary the ground goes on this far (m) beyond everything that is known.
BEYOND_M = 15.0
# Width (m) of the obstructed rim round a boundary. No body is in it, so it need only be there.
RIM_M = 0.5
# Segments of a quarter of a circle round a corner: as they are inside of it, ground for a disc is too large, if at all.
QUARTER = 4
# Grounds for discs that are kept.
DISCS_KEPT = 32


@dataclass(frozen=True)
class ObstructedGround:
    """Ground with what obstructs it.

    Attributes:
        free: Ground that nothing obstructs (m, map frame).
    """

    free: shapely.Polygon | shapely.MultiPolygon

    @classmethod
    def of(
        cls,
        boundary: shapely.Polygon | shapely.MultiPolygon | None,
        obstacles: Sequence[shapely.Polygon | shapely.MultiPolygon],
        around: Sequence[tuple[float, float]] = (),
    ) -> ObstructedGround:
        """Ground inside a boundary and off obstacles.

        Args:
            boundary: Boundary (m, map frame); None: the ground goes on beyond obstacles and `around`.
            obstacles: What is kept off.
            around: Points (m) that are on the ground in any case if there is no boundary.
        """
        if boundary is None:
            known = shapely.union_all([*obstacles, shapely.MultiPoint(list(around))])
            boundary = shapely.box(*known.buffer(BEYOND_M).bounds)
        return cls(as_area(difference(boundary, union(obstacles))))

    @cached_property
    def walls(self) -> WallGrid:
        """Edges of the obstructed ground."""
        rings = [ring for part in shapely.get_parts(self.free) for ring in (part.exterior, *part.interiors)]
        corners = [shapely.get_coordinates(ring) for ring in rings]
        return WallGrid.of(np.concatenate([np.empty((0, 4)), *(np.hstack((ring[:-1], ring[1:])) for ring in corners)]))

    def joins(self, first: tuple[float, float], second: tuple[float, float], radius_m: float) -> bool:
        """Return whether a disc may get from one place to another; False only if it surely cannot.

        Args:
            first: Middle of the disc (m, map frame).
            second: The other place.
            radius_m: Radius of the disc.
        """
        for part in _ground_for_disc(self, radius_m):
            if shapely.intersects_xy(part, *first):
                return bool(shapely.intersects_xy(part, *second))
        return False

    @cached_property
    def obstructed(self) -> list[Floats]:
        """Convex parts (n, 2) of the obstructed ground (m), of the outside a rim."""
        return convex_parts(as_area(difference(self.hull, self.free)))

    @cached_property
    def hull(self) -> shapely.Polygon:
        """Rectangle round the ground and its rim."""
        return shapely.box(*buffer(self.free, RIM_M, join_style="mitre", quad_segs=1).bounds)


@lru_cache(DISCS_KEPT)
def _ground_for_disc(ground: ObstructedGround, radius_m: float) -> list[shapely.Polygon]:
    """Parts of a ground in which a disc's middle may be; hole by hole, which is many times quicker than all at once."""
    parts = list[shapely.Polygon]()
    for part in shapely.get_parts(ground.free):
        within = buffer(shapely.Polygon(part.exterior), -radius_m, quad_segs=QUARTER)
        holes = [buffer(shapely.Polygon(ring), radius_m, quad_segs=QUARTER) for ring in part.interiors]
        parts.extend(shapely.get_parts(as_area(difference(within, union(holes)))))
    shapely.prepare(parts)
    return parts
