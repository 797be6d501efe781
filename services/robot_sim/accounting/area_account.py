"""Account of a template's areas that a covering tool has passed over so far."""

from __future__ import annotations

from typing import NamedTuple

from touchline.schemas.messages import Trajectory
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.accounting.area_raster import AreaRaster
from touchline.services.robot_sim.paint.ledger import PaintLedger


class AreaStanding(NamedTuple):
    """Figures of all areas together, by the raster."""

    area_m2: float
    covered_m2: float
    coverage_pct: float
    overlap_m2: float
    cell_m: float


class AreaAccount:
    """Account of one traversal.

    The raster follows the strokes of the ledger, from which they are made: a ledger that is restored gives the same.

    Args:
        template: Template with areas.
        trajectory: Trajectory that covers them.
        vehicle: Vehicle with a covering tool.

    Attributes:
        ids: Ids of the areas.
    """

    def __init__(self, template: Template, trajectory: Trajectory, vehicle: Vehicle) -> None:
        self.template, self.trajectory, self.vehicle = template, trajectory, vehicle
        self.ids = tuple(area.id for area in template.areas)
        self._raster = AreaRaster([area.polygon for area in template.areas], vehicle.tool.width_m)

    def take(self, ledger: PaintLedger) -> None:
        """Count the points that the ledger has gained since the last call."""
        self._raster.take(ledger.rows(0)[: ledger.settled])

    @property
    def fractions(self) -> list[float]:
        """Share of each area that was passed over."""
        raster = self._raster
        return [covered / max(1, cells) for covered, cells in zip(raster.covered, raster.cells, strict=True)]

    @property
    def standing(self) -> AreaStanding:
        """Present figures."""
        raster, cell_m2 = self._raster, self._raster.cell_m**2
        cells, covered = sum(raster.cells), sum(raster.covered)
        return AreaStanding(
            cells * cell_m2,
            covered * cell_m2,
            100.0 * covered / max(1, cells),
            sum(raster.overlapped) * cell_m2,
            raster.cell_m,
        )


def area_account(template: Template | None, trajectory: Trajectory, vehicle: Vehicle) -> AreaAccount | None:
    """Make the account of a job; None if it has no area, or no tool that covers.

    Args:
        template: The job's template, if there is one.
        trajectory: Its trajectory.
        vehicle: The robot's vehicle.
    """
    if template is None or not template.areas or not vehicle.tool.covers:
        return None
    return AreaAccount(template, trajectory, vehicle)
