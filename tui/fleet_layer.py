"""What is told of robots as a team, to be drawn on the map of all robots: cells, goals and claimed stretches."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.messages import TeamCells
from touchline.tui.raster import Polyline

Polygon = NDArray[np.float64]
"""(n, 2) corners in metres of the map frame, in order round it, the first one not repeated."""
Line = NDArray[np.float64]
"""(n, 2) points along it in metres of the map frame."""


@dataclass(frozen=True, eq=False)
class FleetLayer:
    """Of each robot, by namespace, what was told last; another one takes the place of this.

    Attributes:
        cells: The convex polygon in which the robot is to keep, by a team's coordinator.
        goals: Where that sends it: (x, y) in metres of the map frame.
        claims: The stretch of its path that the others of a shared job keep off.
    """

    cells: Mapping[str, Polygon] = field(default_factory=dict)
    goals: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    claims: Mapping[str, Line] = field(default_factory=dict)

    def outlines(self, *, of: str | None = None, besides: str | None = None) -> Polyline:
        """The cells' edges, of one robot or of all `besides` one."""
        return outline(cell for name, cell in self.cells.items() if of in (None, name) and name != besides)

    def claimed(self, *, of: str | None = None, besides: str | None = None) -> Polyline:
        """The same of claimed stretches."""
        lines = (line for name, line in self.claims.items() if of in (None, name) and name != besides)
        return Polyline.of([(line[:, 0], line[:, 1]) for line in lines if _drawable(line, 2)])

    def claiming(self, claims: Mapping[str, Line]) -> FleetLayer:
        """It with these claims; itself if it has them."""
        same = claims.keys() == self.claims.keys() and all(line is self.claims[name] for name, line in claims.items())
        return self if same else replace(self, claims=claims)


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
    closed = [np.concatenate((polygon, polygon[:1])) for polygon in polygons if _drawable(polygon, 3)]
    return Polyline.of([(corners[:, 0], corners[:, 1]) for corners in closed])


def _drawable(points: Line, least: int) -> bool:
    return points.ndim == 2 and points.shape[0] >= least and points.shape[1] == 2 and bool(np.isfinite(points).all())
