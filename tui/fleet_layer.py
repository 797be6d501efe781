"""What a coordinator tells of a team, to be drawn on the map of all robots: cells, goals and claimed regions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.messages import TeamCells
from touchline.tui.raster import Polyline

Polygon = NDArray[np.float64]
"""(n, 2) corners in metres of the map frame, in order round it, the first one not repeated."""


@dataclass(frozen=True, eq=False)
class FleetLayer:
    """Of each robot, by namespace, what the coordinator has told last; another one takes the place of this.

    Attributes:
        cells: The convex polygon in which the robot is to keep.
        goals: Where it is sent: (x, y) in metres of the map frame.
        claims: The regions of the field that are its share of the work.
    """

    cells: Mapping[str, Polygon] = field(default_factory=dict)
    goals: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    claims: Mapping[str, tuple[Polygon, ...]] = field(default_factory=dict)

    def outlines(self, *, of: str | None = None, besides: str | None = None) -> Polyline:
        """The cells' edges, of one robot or of all `besides` one."""
        return outline(cell for name, cell in self.cells.items() if of in (None, name) and name != besides)

    def claimed(self, *, of: str | None = None, besides: str | None = None) -> Polyline:
        """The same of claimed regions."""
        shares = (share for name, share in self.claims.items() if of in (None, name) and name != besides)
        return outline(polygon for share in shares for polygon in share)


NO_LAYER = FleetLayer()


def layer_of(told: TeamCells) -> FleetLayer:
    """What a coordinator has told."""
    whole = [cell for cell in told.cells if len(cell.x_m) == len(cell.y_m)]
    return FleetLayer(
        cells={cell.name: np.column_stack((cell.x_m, cell.y_m)) for cell in whole},
        goals={cell.name: (cell.goal_x_m, cell.goal_y_m) for cell in told.cells},
    )


def outline(polygons: Iterable[Polygon]) -> Polyline:
    """The edges of polygons; one without three finite corners has none."""
    closed = [np.concatenate((polygon, polygon[:1])) for polygon in polygons if _drawable(polygon)]
    return Polyline.of([(corners[:, 0], corners[:, 1]) for corners in closed])


def _drawable(polygon: Polygon) -> bool:
    return polygon.ndim == 2 and polygon.shape[0] >= 3 and polygon.shape[1] == 2 and bool(np.isfinite(polygon).all())
