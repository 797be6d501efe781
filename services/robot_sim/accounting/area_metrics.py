"""The figures of areas that a covering tool has been over, exact on polygons."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from touchline.core.missed_patches import Patch, patches
from touchline.core.robust_overlay import buffer, difference, intersection, union
from touchline.core.tool_reach import free_ground, reachable
from touchline.schemas.template import Template
from touchline.services.robot_sim.accounting.area_account import AreaAccount
from touchline.services.robot_sim.accounting.body_outside import body_outside_m
from touchline.services.robot_sim.accounting.planned_way import off_the_way_m, planned_way
from touchline.services.robot_sim.accounting.swept_ground import swept_ground, thinned
from touchline.services.robot_sim.paint.ledger import PaintLedger
from touchline.services.robot_sim.paint.metrics import lateral_error
from touchline.services.robot_sim.paint.segment_metrics import LateralError
from touchline.services.robot_sim.paint.track import Track
from touchline.services.robot_sim.paint.verdict import Verdict

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

REQUIRED_PCT: Final = 99.0
"""Of what the plan would cover; so much has to be covered for the work to be accepted."""
_ROOM_M: Final = 20.0
"""About an area without a boundary: as much as any body is long."""
_LOOK_EVERY_M: Final = 0.1
"""How far off its way the tool is."""


class AreaMetrics(NamedTuple):
    """Of all areas together [m²]."""

    area_m2: float
    covered_m2: float
    reachable_m2: float
    """What the tool can pass over with the body inside the boundary and off obstacles."""
    reached_m2: float
    """Of that it did."""
    planned_m2: float
    """What it would pass over if it drove exactly as planned."""
    as_planned_m2: float
    """Of that it did."""
    overlap_m2: float
    """Passed over more than once."""
    beside_m2: float
    """Passed over outside the areas."""
    missed: list[Patch]
    """The largest first."""
    body_outside_m: float
    """How far the body got beyond the boundary or into an obstacle at most, in what this process has driven."""
    lateral: LateralError
    """Of the tool, off its planned way."""
    way_m: float
    """That the tool went."""

    @property
    def missed_m2(self) -> float:
        """Not passed over, however small the place."""
        return max(0.0, self.area_m2 - self.covered_m2)

    @property
    def coverage_pct(self) -> float:
        """Share of the areas."""
        return _share_pct(self.covered_m2, self.area_m2)

    @property
    def of_reachable_pct(self) -> float:
        """Share of what can be reached."""
        return _share_pct(self.reached_m2, self.reachable_m2)

    @property
    def of_planned_pct(self) -> float:
        """Share of what was planned."""
        return _share_pct(self.as_planned_m2, self.planned_m2)

    @property
    def verdict(self) -> Verdict:
        """Whether enough of what was planned is covered."""
        text = f"{self.of_planned_pct:.2f} % of what the plan covers is covered, {REQUIRED_PCT:g} % is asked for"
        return Verdict(self.of_planned_pct >= REQUIRED_PCT, text)


def area_metrics(account: AreaAccount, ledger: PaintLedger, track: Track) -> AreaMetrics:
    """Work out everything; takes a moment, so once at the end."""
    vehicle, template = account.vehicle, account.template
    strokes = ledger.strokes()
    way = planned_way(account.trajectory, vehicle)
    area = union([area.polygon for area in template.areas])
    swept, twice = swept_ground(strokes)
    planned = intersection(area, swept_ground(way).swept)
    covered = intersection(area, swept)
    tool, width_m = vehicle.tool.point_m, vehicle.tool.width_m
    within_reach = reachable(area, ground_of(template, area), vehicle.body.footprint_m, tool, width_m)
    looked_at = [thinned(stroke, _LOOK_EVERY_M) for stroke in strokes]
    return AreaMetrics(
        area_m2=float(area.area),
        covered_m2=float(covered.area),
        reachable_m2=float(within_reach.area),
        reached_m2=float(intersection(covered, within_reach).area),
        planned_m2=float(planned.area),
        as_planned_m2=float(intersection(covered, planned).area),
        overlap_m2=float(intersection(area, twice).area),
        beside_m2=max(0.0, float(swept.area - covered.area)),
        missed=patches(difference(area, swept)),
        body_outside_m=body_outside_m(track.rows, vehicle.body.footprint_m, template),
        lateral=lateral_error(off_the_way_m(looked_at, way)),
        way_m=sum(float(np.hypot(*np.diff(stroke.points, axis=0).T).sum()) for stroke in strokes),
    )


def ground_of(template: Template, area: BaseGeometry) -> BaseGeometry:
    """Where the body may be: inside the boundary, or anywhere about the area if there is none, and off obstacles."""
    import shapely

    boundary = template.boundary
    inside = shapely.Polygon(boundary.corners) if boundary is not None else buffer(area, _ROOM_M, join_style="mitre")
    return free_ground(inside, [shapely.Polygon(obstacle.corners) for obstacle in template.obstacles])


def _share_pct(part: float, whole: float) -> float:
    """100 where there is nothing to have a share of."""
    return min(100.0, 100.0 * part / whole) if whole > 0.0 else 100.0
