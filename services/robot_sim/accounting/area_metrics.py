"""Figures of areas that a covering tool has passed over, exact on polygons."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from touchline.core.missed_patches import Patch, patches
from touchline.core.plain_sum import plain_sum
from touchline.core.robust_overlay import buffer, difference, intersection, union
from touchline.core.tool_reach import free_ground, reachable
from touchline.schemas.template import Template
from touchline.services.robot_sim.accounting.area_account import AreaAccount
from touchline.services.robot_sim.accounting.body_outside import body_outside_m
from touchline.services.robot_sim.accounting.planned_tool_path import off_path_m, planned_tool_path
from touchline.services.robot_sim.accounting.swept_ground import swept_ground, thinned
from touchline.services.robot_sim.paint.ledger import PaintLedger
from touchline.services.robot_sim.paint.metrics import lateral_error
from touchline.services.robot_sim.paint.segment_metrics import LateralError
from touchline.services.robot_sim.paint.track import Track
from touchline.services.robot_sim.paint.verdict import Verdict

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

REQUIRED_PCT: Final = 99.0
"""Share of the planned ground that has to be covered for the work to be accepted."""
_ROOM_M: Final = 20.0
"""Free ground around an area without a boundary: more than the length of any body."""
_LOOK_EVERY_M: Final = 0.1
"""Spacing of the points at which the tool's distance from its path is measured."""


class AreaMetrics(NamedTuple):
    """Figures of all areas together [m²]."""

    area_m2: float
    covered_m2: float
    reachable_m2: float
    """Ground that the tool can pass over with the body inside the boundary and off obstacles."""
    reached_m2: float
    """The part of that ground that the tool has passed over."""
    planned_m2: float
    """Ground that the tool would pass over if it drove exactly as planned."""
    as_planned_m2: float
    """The part of that ground that the tool has passed over."""
    overlap_m2: float
    """Ground passed over more than once."""
    beside_m2: float
    """Ground passed over outside the areas."""
    missed: list[Patch]
    """Missed patches, the largest first."""
    body_outside_m: float
    """Largest distance of the body beyond the boundary or inside an obstacle, over the part driven by this process."""
    lateral: LateralError
    """Distance of the tool from its planned path."""
    distance_m: float
    """Length of the tool's path."""

    @property
    def missed_m2(self) -> float:
        """Area not passed over, including the smallest patches."""
        return max(0.0, self.area_m2 - self.covered_m2)

    @property
    def coverage_pct(self) -> float:
        """Covered share of the areas [%]."""
        return _share_pct(self.covered_m2, self.area_m2)

    @property
    def of_reachable_pct(self) -> float:
        """Covered share of the reachable ground [%]."""
        return _share_pct(self.reached_m2, self.reachable_m2)

    @property
    def of_planned_pct(self) -> float:
        """Covered share of the planned ground [%]."""
        return _share_pct(self.as_planned_m2, self.planned_m2)

    @property
    def verdict(self) -> Verdict:
        """Acceptance: enough of the planned ground is covered."""
        text = f"{self.of_planned_pct:.2f} % of what the plan covers is covered, {REQUIRED_PCT:g} % is asked for"
        return Verdict(self.of_planned_pct >= REQUIRED_PCT, text)


def area_metrics(account: AreaAccount, ledger: PaintLedger, track: Track) -> AreaMetrics:
    """Compute all figures; this takes a moment, so it is done once at the end.

    Args:
        account: Template, trajectory and vehicle.
        ledger: Strokes of the tool.
        track: True path of the robot.
    """
    vehicle, template = account.vehicle, account.template
    strokes = ledger.strokes()
    path = planned_tool_path(account.trajectory, vehicle)
    area = union([area.polygon for area in template.areas])
    swept, twice = swept_ground(strokes)
    planned = intersection(area, swept_ground(path).swept)
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
        lateral=lateral_error(off_path_m(looked_at, path)),
        distance_m=plain_sum(float(np.hypot(*np.diff(stroke.points, axis=0).T).sum()) for stroke in strokes),
    )


def ground_of(template: Template, area: BaseGeometry) -> BaseGeometry:
    """Return the ground for the body: inside the boundary, or around the area if there is none, and off obstacles.

    Args:
        template: Gives boundary and obstacles.
        area: Union of its areas.
    """
    import shapely

    boundary = template.boundary
    inside = shapely.Polygon(boundary.corners) if boundary is not None else buffer(area, _ROOM_M, join_style="mitre")
    return free_ground(inside, [shapely.Polygon(obstacle.corners) for obstacle in template.obstacles])


def _share_pct(part: float, whole: float) -> float:
    """Return the percentage; 100 if the whole is empty."""
    return min(100.0, 100.0 * part / whole) if whole > 0.0 else 100.0
