"""Pieces of ground that are worth a machine's time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from touchline.core.robust_overlay import as_area, buffer, intersection, union
from touchline.core.tool_reach import Point, reachable

if TYPE_CHECKING:
    import shapely
    from shapely.geometry.base import BaseGeometry

HAIR_M: Final = 0.2
"""Width below which pieces are ignored: they come from rounding, tools slightly beside their path, and overlaps of
joints."""
STRAIGHT_M: Final = 0.02
"""Edges along bends are simplified to straights within this distance."""
MITRE: Final = 2.0
"""Mitre limit of corners."""
SLIVER_M2: Final = 1.0
"""Area below which pieces are ignored if they are nowhere half as wide as the tool: they lie where turns meet."""


def wide_parts(ground: BaseGeometry, least_m: float) -> shapely.Polygon | shapely.MultiPolygon:
    """Return the pieces of ground that are at least `least_m` wide somewhere."""
    import shapely

    kept = [part for part in shapely.get_parts(ground) if not buffer(part, -0.5 * least_m).is_empty]
    return kept[0] if len(kept) == 1 else shapely.MultiPolygon(kept)


def worthwhile_pieces(
    ground: BaseGeometry, width_m: float, wider_m: float = 0.0
) -> shapely.Polygon | shapely.MultiPolygon:
    """Return the pieces that are worth their time, without narrow strips.

    Args:
        ground: Ground to work on (m, map frame).
        width_m: Width of the tool.
        wider_m: Distance by which the pieces are widened.
    """
    import shapely

    opened = buffer(ground, -0.5 * HAIR_M, join_style="mitre", mitre_limit=MITRE)
    whole = shapely.simplify(buffer(opened, 0.5 * HAIR_M, join_style="mitre", mitre_limit=MITRE), STRAIGHT_M)
    wide = wide_parts(as_area(whole), 0.5 * width_m)
    large = [part for part in shapely.get_parts(whole) if part.area >= SLIVER_M2]
    return as_area(buffer(union([wide, *large]), wider_m, join_style="mitre", mitre_limit=MITRE))


def pieces_within_reach(
    ground: BaseGeometry, free: BaseGeometry, outline: Sequence[Point], tool: Point, width_m: float
) -> shapely.MultiPolygon:
    """Return the pieces of ground of which a tool can reach a worthwhile part; arguments as of `reachable`."""
    import shapely

    at = as_area(reachable(ground, free, outline, tool, width_m))
    kept = [part for part in shapely.get_parts(ground) if intersection(part, at).area >= SLIVER_M2]
    return shapely.MultiPolygon(kept)
