"""Team layer of the fleet map: cells, goals and claimed stretches."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.messages import TeamCells
from touchline.tui.raster import Polyline

Polygon = NDArray[np.float64]
"""Corners (n, 2) in metres of the map frame, in order, the first one not repeated."""
Line = NDArray[np.float64]
"""Points (n, 2) in metres of the map frame."""


@dataclass(frozen=True, eq=False)
class FleetLayer:
    """Last report of a team, by robot namespace; immutable.

    Attributes:
        cells: Convex polygon that a team's coordinator assigns to the robot.
        goals: Goal (x, y) that it assigns, in metres of the map frame.
        claims: Stretch of the robot's path that the others of a shared job keep off.
    """

    cells: Mapping[str, Polygon] = field(default_factory=dict)
    goals: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    claims: Mapping[str, Line] = field(default_factory=dict)

    def outlines(self, *, of: str | None = None, besides: str | None = None) -> Polyline:
        """Edges of the cells, of one robot or of all `besides` one."""
        return outline(cell for name, cell in self.cells.items() if of in (None, name) and name != besides)

    def claimed(self, *, of: str | None = None, besides: str | None = None) -> Polyline:
        """Claimed stretches, of one robot or of all `besides` one."""
        lines = (line for name, line in self.claims.items() if of in (None, name) and name != besides)
        return Polyline.of([(line[:, 0], line[:, 1]) for line in lines if _drawable(line, 2)])

    def claiming(self, claims: Mapping[str, Line]) -> FleetLayer:
        """Replace the claims; returns the layer itself if nothing changes."""
        same = claims.keys() == self.claims.keys() and all(line is self.claims[name] for name, line in claims.items())
        return self if same else replace(self, claims=claims)


NO_LAYER = FleetLayer()


def layer_of(team: TeamCells) -> FleetLayer:
    """Create the layer from a coordinator's message."""
    whole = [cell for cell in team.cells if len(cell.x_m) == len(cell.y_m)]
    return FleetLayer(
        cells={cell.name: np.column_stack((cell.x_m, cell.y_m)) for cell in whole},
        goals={cell.name: (cell.goal_x_m, cell.goal_y_m) for cell in team.cells},
    )


def outline(polygons: Iterable[Polygon]) -> Polyline:
    """Edges of polygons; polygons with fewer than three finite corners have none."""
    closed = [np.concatenate((polygon, polygon[:1])) for polygon in polygons if _drawable(polygon, 3)]
    return Polyline.of([(corners[:, 0], corners[:, 1]) for corners in closed])


def _drawable(points: Line, least: int) -> bool:
    return points.ndim == 2 and points.shape[0] >= least and points.shape[1] == 2 and bool(np.isfinite(points).all())
